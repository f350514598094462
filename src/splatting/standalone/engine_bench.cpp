// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Speed of the engine on this machine's GPU on a synthetic cloud: training steps, rendered frames and undistorted
// frames (color and depth; also by one core, and while another thread trains), as JSON.
// Usage: engine_bench [WIDTH HEIGHT GAUSSIANS STEPS]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stop_token>
#include <thread>

#include "splatting/cuda/test_device.h"
#include "splatting/testing/scenes.h"

namespace photoslam::splatting::cuda {
namespace {

using testing::Scene;

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Gaussians that cover the image about as a trained room does: many small, few large.
Scene make_cloud(int width, int height, int count) {
  Scene scene;
  scene.width = width;
  scene.height = height;
  scene.count = count;
  scene.depth_min = 1;
  const double spacing = std::log(2.0 / std::sqrt(static_cast<double>(count)));
  scene.log_scale_min = spacing - 1;
  scene.log_scale_max = spacing + 1.3;
  scene.build(1);
  return scene;
}

struct Setup {
  std::vector<AnchorView> anchors;
  DeviceView view;
  std::vector<uint8_t> rgb;
  DeviceTarget target;
  DeviceLoss loss;
  UpdateConstants constants;

  explicit Setup(const Scene& scene) : rgb(3 * scene.plane(), 128) {
    anchors.push_back(make_anchor_view(scene.poses[0], scene.view.camera, RenderOptions()));
    view.width = scene.width;
    view.height = scene.height;
    view.sh_degree = 3;
    view.anchors = anchors.data();
    view.num_anchors = 1;
    for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<uint8_t>(i * 2654435761u >> 24);
    target.id = 1;
    target.width = scene.width;
    target.height = scene.height;
    target.rgb = rgb.data();
    target.num_valid = static_cast<int>(scene.plane());
    loss.ssim_weight = 0.2f;
    constants.beta1 = 0.9f;
    constants.beta2 = 0.999f;
    constants.epsilon2 = 1e-30f;
    constants.log_beta1 = std::log(0.9f);
    constants.log_beta2 = std::log(0.999f);
    constants.bias_correction = true;
    std::fill_n(constants.rates, row::kCount, 1e-4f);
  }
};

/// A frame through a lens that bends as usual ones do, by about a tenth at the corners.
class FrameBench {
 public:
  FrameBench(int width, int height)
      : width_(width), pixels_(static_cast<size_t>(width) * static_cast<size_t>(height)), taps_(pixels_) {
    const double cx = (width - 1) / 2.0, cy = (height - 1) / 2.0;
    for (size_t i = 0; i < pixels_; ++i) {
      const size_t column = i % static_cast<size_t>(width), row = i / static_cast<size_t>(width);
      const double x = static_cast<double>(column) - cx, y = static_cast<double>(row) - cy;
      const double scale = 1 - 0.1 * (x * x + y * y) / (cx * cx + cy * cy);
      const double u = 256 * (scale * x + cx), v = 256 * (scale * y + cy);
      taps_[i] = {static_cast<uint16_t>(u / 256), static_cast<uint16_t>(v / 256),
                  static_cast<uint16_t>(static_cast<int>(u) % 256), static_cast<uint16_t>(static_cast<int>(v) % 256)};
      for (size_t c = 0; c < 3; ++c) rgb_[3 * i + c] = static_cast<uint8_t>((3 * i + c) * 2654435761u >> 24);
      depth_[i] = static_cast<uint16_t>(i * 2654435761u >> 16);
    }
  }
  DeviceLens lens() const {
    const int height = static_cast<int>(pixels_ / static_cast<size_t>(width_));
    return {width_, height, taps_.data(), width_, height};
  }
  /// Milliseconds of frame after frame, ascending.
  std::vector<double> on(DeviceUndistorter& undistorter, int frames) {
    using Kind = DevicePicture::Kind;
    const DevicePicture pictures[] = {{0, Kind::rgb, rgb_.data(), rgb_there_.data()},
                                      {0, Kind::depth, depth_.data(), depth_there_.data()}};
    return timed(frames, [&] { undistorter.undistort(pictures, 2); });
  }
  std::vector<double> on_host(int frames) {
    const size_t pitch = static_cast<size_t>(width_);
    return timed(frames, [&] {
      for (size_t i = 0; i < pixels_; ++i) sample_color<3>(rgb_.data(), 3 * pitch, taps_[i], &rgb_here_[3 * i]);
      for (size_t i = 0; i < pixels_; ++i) depth_here_[i] = sample_depth(depth_.data(), pitch, taps_[i]);
    });
  }
  bool agrees() const { return rgb_here_ == rgb_there_ && depth_here_ == depth_there_; }

 private:
  template <class Work>
  static std::vector<double> timed(int frames, const Work& work) {
    std::vector<double> times;
    for (int i = -5; i < frames; ++i) {
      const auto start = std::chrono::steady_clock::now();
      work();
      if (i >= 0) times.push_back(milliseconds_since(start));
    }
    std::sort(times.begin(), times.end());
    return times;
  }

  int width_;
  size_t pixels_;
  std::vector<Tap> taps_;
  std::vector<uint8_t> rgb_ = std::vector<uint8_t>(3 * pixels_), rgb_here_ = rgb_, rgb_there_ = rgb_;
  std::vector<uint16_t> depth_ = std::vector<uint16_t>(pixels_), depth_here_ = depth_, depth_there_ = depth_;
};

/// Figures of undistortion; `train` is one training step. False: host and device differ.
template <class Train>
bool bench_frames(DeviceEngine& engine, int width, int height, int frames, const Train& train) {
  FrameBench bench(width, height);
  const DeviceLens lens = bench.lens();
  const auto undistorter = engine.make_undistorter(&lens, 1);
  const std::vector<double> alone = bench.on(*undistorter, frames), host = bench.on_host(std::min(frames, 20));
  std::vector<double> beside;
  {
    const std::jthread training([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) train();
    });
    beside = bench.on(*undistorter, frames);
  }
  std::printf(" \"undistort_ms\": %.3f, \"undistort_host_ms\": %.3f, \"undistort_while_training_ms\": %.3f,",
              alone[alone.size() / 2], host[host.size() / 2], beside[beside.size() / 2]);
  std::printf(" \"undistort_while_training_p99_ms\": %.3f,\n", beside[beside.size() * 99 / 100]);
  return bench.agrees();
}

int run(int width, int height, int count, int steps) {
  const Scene scene = make_cloud(width, height, count);
  const Setup setup(scene);
  Engine<TestDevice> engine(TestDevice(), uint64_t{2000} * 1000 * 1000);
  upload_model(scene.model, engine);
  Figures figures;
  std::vector<double> step_ms, render_ms, stages[6];
  for (int i = -5; i < steps; ++i) {
    const auto start = std::chrono::steady_clock::now();
    figures = engine.step(setup.view, setup.target, setup.loss, setup.constants, true);
    if (i < 0) continue;
    step_ms.push_back(milliseconds_since(start));
    for (int s = 0; s < 6; ++s) stages[s].push_back(static_cast<double>(figures.times[s]));
  }
  for (int i = -5; i < steps; ++i) {
    const auto start = std::chrono::steady_clock::now();
    engine.forward(setup.view, false);
    if (i >= 0) render_ms.push_back(milliseconds_since(start));
  }
  std::printf("{\"size\": \"%dx%d\", \"gaussians\": %d, \"visible\": %u, \"instances\": %u, \"lost\": %u,\n", width,
              height, count, figures.visible, figures.instances, figures.lost);
  const bool agrees = bench_frames(engine, width, height, steps,
                                   [&] { engine.step(setup.view, setup.target, setup.loss, setup.constants, true); });
  std::printf(" \"step_ms\": %.3f, \"render_ms\": %.3f, \"peak_mb\": %.0f,\n \"stages_ms\": {", median(step_ms),
              median(render_ms), 1e-6 * static_cast<double>(engine.peak_bytes()));
  constexpr const char* kNames[6] = {"project", "sort", "forward", "loss", "backward", "update"};
  for (int s = 0; s < 6; ++s) std::printf("%s\"%s\": %.3f", s > 0 ? ", " : "", kNames[s], median(stages[s]));
  std::printf("}}\n");
  return agrees ? 0 : 1;
}

}  // namespace
}  // namespace photoslam::splatting::cuda

int main(int argc, char** argv) {
  const auto number = [&](int i, int standard) { return argc > i ? std::max(1, std::atoi(argv[i])) : standard; };
  try {
    return photoslam::splatting::cuda::run(number(1, 1200), number(2, 680), number(3, 150000), number(4, 200));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "engine_bench: %s\n", error.what());
    return 1;
  }
}
