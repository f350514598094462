// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Speed of the engine on this machine's GPU on a synthetic cloud: training steps and rendered frames, as JSON.
// Usage: engine_bench [WIDTH HEIGHT GAUSSIANS STEPS]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

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
  std::printf(" \"step_ms\": %.3f, \"render_ms\": %.3f, \"peak_mb\": %.0f,\n \"stages_ms\": {", median(step_ms),
              median(render_ms), 1e-6 * static_cast<double>(engine.peak_bytes()));
  constexpr const char* kNames[6] = {"project", "sort", "forward", "loss", "backward", "update"};
  for (int s = 0; s < 6; ++s) std::printf("%s\"%s\": %.3f", s > 0 ? ", " : "", kNames[s], median(stages[s]));
  std::printf("}}\n");
  return 0;
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
