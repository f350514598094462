// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// The kernels and what runs them, against plain code and double-precision oracles: on the host, or where nvcc compiles
// this file, on a GPU.
#ifndef __SANITIZE_THREAD__  // it does not know fibers

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "splatting/cuda/test_device.h"
#include "splatting/testing/reference_loss.h"
#include "splatting/testing/scenes.h"

namespace photoslam::splatting::cuda {
namespace {

using testing::Scene;

constexpr uint64_t kPlenty = uint64_t{1} << 30;

/// A scene's model on a device.
struct OnDevice {
  Engine<TestDevice> engine;
  std::vector<AnchorView> anchors;
  DeviceView view;
  size_t plane;
  size_t num_blocks;
  std::vector<float> rgb, depth, alpha;
  Figures figures;

  explicit OnDevice(const Scene& scene, uint64_t memory_limit = kPlenty, TestDevice device = TestDevice(),
                    uint32_t most_instances = Engine<TestDevice>::kMostInstances)
      : engine(std::move(device), memory_limit, most_instances),
        plane(scene.plane()),
        num_blocks(scene.model.num_blocks()) {
    for (const splatting::Pose& pose : scene.poses)
      anchors.push_back(make_anchor_view(pose, scene.view.camera, scene.options));
    view.width = scene.width;
    view.height = scene.height;
    view.sh_degree = std::min(scene.options.sh_degree, scene.model.sh_degree());
    std::copy_n(scene.options.background, 3, view.background);
    view.anchors = anchors.data();
    view.num_anchors = static_cast<uint32_t>(anchors.size());
    upload_model(scene.model, engine);
  }
  void draw() {
    figures = engine.forward(view, true);
    read_image();
  }
  void read_image() {
    rgb.resize(3 * plane);
    depth.resize(plane);
    alpha.resize(plane);
    engine.read_image({rgb.data(), depth.data(), alpha.data()});
  }
  /// All rows of the blocks: [num_blocks, row::kTableRows, 64].
  std::vector<float> rows() {
    std::vector<float> values(num_blocks * row::kTableRows * kBlockSize);
    engine.fetch(0, row::kTableRows, values.data());
    return values;
  }
  static size_t row_at(size_t index, int row, int num_rows = row::kTableRows) {
    return (index / kBlockSize * static_cast<size_t>(num_rows) + static_cast<size_t>(row)) * kBlockSize +
           index % kBlockSize;
  }
};

TEST(CudaEngine, SortIsStable) {
  Random random(5);
  TestDevice device;
  Memory<TestDevice> memory(device, kPlenty);
  for (const uint32_t size : {0u, 1u, 2048u, 5001u}) {
    const uint32_t capacity = size + 7;
    std::vector<uint32_t> keys(capacity), values(capacity);
    for (uint32_t& key : keys) key = static_cast<uint32_t>(random.index(300)) * 70001;
    std::iota(values.begin(), values.end(), 0u);
    std::vector<uint32_t> want(values.begin(), values.begin() + size);
    std::stable_sort(want.begin(), want.end(), [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
    Pairs<TestDevice> pairs(memory);
    pairs.reserve(capacity);
    device.upload(pairs.keys(), keys.data(), capacity * sizeof(uint32_t));
    device.upload(pairs.values(), values.data(), capacity * sizeof(uint32_t));
    const auto device_size = to_device<uint32_t>(device, memory, {size});
    pairs.sort(device, device_size.data(), capacity, 32);
    std::vector<uint32_t> got(size);
    device.download(got.data(), pairs.values(), size * sizeof(uint32_t));
    EXPECT_EQ(got, want);
  }
}

TEST(CudaEngine, PrefixSumsSpanRows) {
  TestDevice device;
  Memory<TestDevice> memory(device, kPlenty);
  constexpr uint32_t kCount = 3 * kPrefixColumns + 5;
  std::vector<uint32_t> values(padded_for_prefix(kCount)), want(kCount);
  for (uint32_t i = 0; i < kCount; ++i) values[i] = i % 7;
  std::exclusive_scan(values.begin(), values.begin() + kCount, want.begin(), 0u);
  const auto array = to_device(device, memory, values);
  const auto rows = to_device(device, memory, std::vector<uint32_t>(4));
  const auto total = to_device(device, memory, std::vector<uint32_t>(1));
  prefix_sums(device, array.data(), kCount, rows.data(), total.data());
  EXPECT_EQ(to_host(device, array, kCount), want);
  EXPECT_EQ(to_host(device, total, 1)[0], want.back() + (kCount - 1) % 7);
}

TEST(CudaEngine, PrefixSumsStayAtTheLargestNumber) {
  TestDevice device;
  Memory<TestDevice> memory(device, kPlenty);
  for (const uint32_t step : {1u, 300u, kPrefixColumns}) {  // within a round of threads, a row, and from row to row
    constexpr uint32_t kCount = 6 * kPrefixColumns;
    std::vector<uint32_t> values(kCount), want(kCount);
    uint64_t sum = 0;
    for (uint32_t i = 0; i < kCount; ++i) {
      values[i] = i % step == 0 && i < 6 * step ? 0x30000000u + i : 0;
      want[i] = static_cast<uint32_t>(std::min<uint64_t>(sum, 0xffffffffu));
      sum += values[i];
    }
    const auto array = to_device(device, memory, values);
    const auto rows = to_device(device, memory, std::vector<uint32_t>(6));
    const auto total = to_device(device, memory, std::vector<uint32_t>(1));
    prefix_sums(device, array.data(), kCount, rows.data(), total.data());
    EXPECT_EQ(to_host(device, array, kCount), want) << step;
    EXPECT_EQ(to_host(device, total, 1)[0], 0xffffffffu) << step;
  }
}

TEST(CudaEngine, ImagesEqualTheOracle) {
  for (Scene& scene : testing::hard_scenes()) {
    scene.build(11);
    const reference::Image want = reference::render(scene.reference_gaussians, scene.reference_view, scene.noise);
    OnDevice got(scene);
    got.draw();
    ASSERT_EQ(got.figures.lost, 0u) << scene.name;
    double worst = 0;
    for (size_t i = 0; i < scene.plane(); ++i) {
      if (want.ambiguous[i]) continue;
      for (size_t k = 0; k < 3; ++k)
        worst = std::max(
            worst, std::abs(static_cast<double>(got.rgb[k * scene.plane() + i]) - want.rgb[k * scene.plane() + i]));
      worst = std::max(worst, std::abs(static_cast<double>(got.alpha[i]) - want.alpha[i]));
      worst = std::max(worst, std::abs(static_cast<double>(got.depth[i]) - want.depth[i]) / scene.depth_max);
    }
    std::printf("  %-16s max error %.1e, %u instances\n", scene.name.c_str(), worst, got.figures.instances);
    EXPECT_LE(worst, scene.image_tolerance) << scene.name;
  }
}

/// Relative L2 distance; zero against zero is zero.
double relative_error(const std::vector<double>& got, const std::vector<double>& want) {
  double difference = 0, norm = 0;
  for (size_t i = 0; i < got.size(); ++i) {
    difference += (got[i] - want[i]) * (got[i] - want[i]);
    norm += want[i] * want[i];
  }
  return norm > 0 ? std::sqrt(difference / norm) : std::sqrt(difference);
}

TEST(CudaEngine, GradientsEqualTheOracle) {
  constexpr int kGroups[][2] = {{0, 3}, {3, 7}, {7, 10}, {10, 11}, {11, 14}, {14, 59}};
  for (Scene& scene : testing::hard_scenes()) {
    scene.build(12);
    const reference::Image image = reference::render(scene.reference_gaussians, scene.reference_view, scene.noise);
    Random random(13);
    const size_t plane = scene.plane();
    std::vector<double> dl_drgb(3 * plane), dl_ddepth(plane), dl_dalpha(plane);
    for (size_t i = 0; i < plane; ++i) {
      const double keep = image.ambiguous[i] ? 0 : 1;
      for (size_t k = 0; k < 3; ++k) dl_drgb[k * plane + i] = static_cast<float>(keep * random.normal());
      dl_ddepth[i] = static_cast<float>(keep * 0.3 * random.normal());
      dl_dalpha[i] = static_cast<float>(keep * 0.3 * random.normal());
    }
    const reference::Gradients want =
        reference::backward(scene.reference_gaussians, scene.reference_view, dl_drgb, dl_ddepth, dl_dalpha);
    const auto floats = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
    OnDevice device(scene);
    device.engine.forward(device.view, true);
    std::vector<float> got(device.num_blocks * static_cast<size_t>(row::kCount) * kBlockSize);
    const Figures figures =
        device.engine.backward(floats(dl_drgb).data(), floats(dl_ddepth).data(), floats(dl_dalpha).data(), got.data());
    for (const auto& group : kGroups) {
      std::vector<double> a, b;
      for (size_t i = 0; i < scene.indices.size(); ++i)
        for (int r = group[0]; r < group[1]; ++r) {
          a.push_back(static_cast<double>(got[OnDevice::row_at(scene.indices[i], r, row::kCount)]));
          b.push_back(want.parameters[i][static_cast<size_t>(r)]);
        }
      EXPECT_LE(relative_error(a, b), scene.gradient_tolerance) << scene.name << " row " << group[0];
    }
    EXPECT_LE(relative_error({figures.pose, figures.pose + 6}, {want.pose.begin(), want.pose.end()}),
              scene.gradient_tolerance)
        << scene.name;
  }
}

/// Sums and gradient image of a loss case, by the kernels.
struct LossOnDevice {
  double l1 = 0, ssim = 0, gain[3] = {}, bias[3] = {};
  std::vector<float> gradient;

  LossOnDevice(const reference::LossCase& c, float lambda) {
    TestDevice device;
    Memory<TestDevice> memory(device, kPlenty);
    const Extent image{c.width, c.height};
    const auto render = to_device(device, memory, std::vector<float>(c.render.begin(), c.render.end()));
    std::vector<uint8_t> planes(c.target.size());
    for (size_t i = 0; i < planes.size(); ++i) planes[i % 3 * c.plane() + i / 3] = c.target[i];
    const auto target = to_device(device, memory, planes);
    const auto mask = to_device(device, memory, c.mask);
    Array<float, TestDevice> derivatives(memory), dl_drgb(memory), sums(memory);
    Array<double, TestDevice> totals(memory);
    derivatives.take(9 * c.plane());
    dl_drgb.take(3 * c.plane());
    sums.take(static_cast<size_t>(3 * kLossSums * image.tiles()));
    totals.take(3 * kLossSums);
    const Comparison images{render.data(),
                            target.data(),
                            c.mask.empty() ? nullptr : mask.data(),
                            image,
                            {c.gain[0], c.gain[1], c.gain[2]},
                            {c.bias[0], c.bias[1], c.bias[2]}};
    const double values =
        3.0 * static_cast<double>(c.plane() - static_cast<size_t>(std::count(c.mask.begin(), c.mask.end(), 0)));
    device.clear(sums.data(), sums.size() * sizeof(float));
    if (lambda > 0) device.launch(3 * image.tiles(), SsimKernel{images, derivatives.data(), sums.data()});
    device.launch(3 * image.tiles(), PhotometricKernel{images, lambda > 0 ? derivatives.data() : nullptr,
                                                       static_cast<float>((1 - static_cast<double>(lambda)) / values),
                                                       static_cast<float>(static_cast<double>(lambda) / values),
                                                       dl_drgb.data(), sums.data()});
    device.launch(3 * kLossSums, SumRows{sums.data(), image.tiles(), totals.data()});
    gradient = to_host(device, dl_drgb, 3 * c.plane());
    const std::vector<double> all = to_host(device, totals, 3 * kLossSums);
    for (int k = 0; k < 3; ++k) {
      const double* channel = all.data() + k * kLossSums;
      l1 += channel[kSumL1] / values;
      ssim += channel[kSumSsim] / values;
      bias[k] = channel[kSumBias];
      gain[k] = (channel[kSumValue] - static_cast<double>(c.bias[k]) * bias[k]) / static_cast<double>(c.gain[k]);
    }
  }
};

TEST(CudaEngine, LossEqualsTheDefinition) {
  for (const auto& [w, h] : {std::pair{37, 29}, {64, 50}, {1, 1}, {5, 3}, {16, 33}})
    for (const bool masked : {false, true}) {
      const reference::LossCase c = reference::make_loss_case(w, h, masked && w > 5, 3);
      double ssim = 0;
      const double want = reference::photometric_loss(c, 0.2, c.render, &ssim);
      const LossOnDevice got(c, 0.2f);
      EXPECT_NEAR(0.8 * got.l1 + 0.2 * (1 - got.ssim), want, 2e-6) << w << "x" << h;
      EXPECT_NEAR(got.ssim, ssim, 1e-5) << w << "x" << h;
      EXPECT_NEAR(LossOnDevice(c, 0).l1, reference::photometric_loss(c, 0, c.render), 1e-6);
      for (size_t i = 0; i < got.gradient.size(); ++i)
        ASSERT_TRUE(c.mask.empty() || c.mask[i % c.plane()] != 0 || got.gradient[i] == 0.0f) << i;
    }
}

TEST(CudaEngine, LossGradientAgreesWithFiniteDifferences) {
  for (const bool masked : {false, true})
    for (const double lambda : {0.0, 0.2, 1.0}) {
      const reference::LossCase c = reference::make_loss_case(18, 37, masked, 7);
      const LossOnDevice got(c, static_cast<float>(lambda));
      EXPECT_LE(reference::gradient_error(c, lambda, got.gradient), 1e-4)
          << "lambda " << lambda << " masked " << masked;
    }
}

TEST(CudaEngine, ExposureGradientAgreesWithFiniteDifferences) {
  const reference::LossCase c = reference::make_loss_case(40, 30, true, 9);
  const LossOnDevice got(c, 0.2f);
  for (size_t k = 0; k < 6; ++k) {
    const auto moved = [&](float step) {
      reference::LossCase other = c;
      (k < 3 ? other.gain[k] : other.bias[k - 3]) += step;
      return reference::photometric_loss(other, 0.2, other.render);
    };
    const double numeric = (moved(1e-4f) - moved(-1e-4f)) / 2e-4;
    EXPECT_NEAR(k < 3 ? got.gain[k] : got.bias[k - 3], numeric, 2e-3 * std::abs(numeric) + 1e-4) << k;
  }
}

TEST(CudaEngine, DepthLossComparesWithTheDepthThatTheOpacityAllows) {
  // D = 1.5, A = 0.5, d = 2: residual 0.5; a pixel without depth does not count.
  TestDevice device;
  Memory<TestDevice> memory(device, kPlenty);
  const auto depth = to_device<float>(device, memory, {1.5f, 9});
  const auto alpha = to_device<float>(device, memory, {0.5f, 1});
  const auto truth = to_device<uint16_t>(device, memory, {2000, 0});
  const auto by_depth = to_device<float>(device, memory, {7, 7}), by_alpha = to_device<float>(device, memory, {7, 7});
  const auto sum = to_device<float>(device, memory, {7});
  device.launch(1, DepthLossKernel{depth.data(), alpha.data(), truth.data(), 2, 1e-3f, 3, by_depth.data(),
                                   by_alpha.data(), sum.data()});
  EXPECT_NEAR(to_host(device, sum, 1)[0], 0.5, 1e-6);
  EXPECT_EQ(to_host(device, by_depth, 2), (std::vector<float>{3, 0}));
  EXPECT_EQ(to_host(device, by_alpha, 2), (std::vector<float>{-6, -0.0f}));
}

/// Target, loss and constants of training steps on a scene.
struct Lesson {
  std::vector<uint8_t> rgb;
  DeviceTarget target;
  DeviceLoss loss;
  UpdateConstants constants;

  explicit Lesson(const Scene& scene) : rgb(3 * scene.plane()) {
    Random random(22);
    for (uint8_t& value : rgb) value = static_cast<uint8_t>(random.index(256));
    target.id = 1;
    target.width = scene.width;
    target.height = scene.height;
    target.rgb = rgb.data();
    target.num_valid = static_cast<int>(scene.plane());
    constants.beta1 = 0.9f;
    constants.beta2 = 0.999f;
    constants.epsilon2 = 1e-30f;
    constants.log_beta1 = std::log(0.9f);
    constants.log_beta2 = std::log(0.999f);
    constants.bias_correction = true;
    for (int r = 0; r < row::kCount; ++r) constants.rates[r] = r < row::kSh ? 1e-3f : 2e-3f;
    constants.rates[row::kOpacity] = 0;  // frozen
  }
  /// dL/drgb of the L1 loss, in the render's layout.
  std::vector<float> l1_gradient(const std::vector<float>& render) const {
    std::vector<float> gradient(rgb.size());
    for (size_t i = 0; i < rgb.size(); ++i) {
      const float difference = render[i] - static_cast<float>(rgb[i]) / 255.0f;
      const float scale = 1.0f / static_cast<float>(rgb.size());
      gradient[i] = difference > 0 ? scale : -scale;
    }
    return gradient;
  }
};

TEST(CudaEngine, StepIsAdamOnTheGradientsOfTheLoss) {
  Scene scene;
  scene.anchors = 2;
  scene.build(21);
  const Lesson lesson(scene);
  OnDevice device(scene);
  std::vector<double> m(device.num_blocks * row::kCount * kBlockSize), v(m.size()),
      visible(device.num_blocks * kBlockSize);
  for (int step = 1; step <= 3; ++step) {
    device.draw();
    std::vector<float> gradients(m.size());
    const Figures plain =
        device.engine.backward(lesson.l1_gradient(device.rgb).data(), nullptr, nullptr, gradients.data());
    const std::vector<float> before = device.rows();
    const Figures figures = device.engine.step(device.view, lesson.target, lesson.loss, lesson.constants, true);
    const std::vector<float> after = device.rows();
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(figures.pose[i], plain.pose[i], 1e-6 * std::abs(plain.pose[i]) + 1e-12);
    int num_visible = 0;
    for (const size_t index : scene.indices) {
      const auto now = [&](int row) { return static_cast<double>(after[OnDevice::row_at(index, row)]); };
      const auto was = [&](int row) { return static_cast<double>(before[OnDevice::row_at(index, row)]); };
      const bool is_visible = now(row::kStatistics + 3) > was(row::kStatistics + 3);
      num_visible += is_visible ? 1 : 0;
      visible[index] += is_visible ? 1 : 0;
      EXPECT_EQ(now(row::kStatistics - 1), visible[index]);
      for (int r = 0; r < row::kCount; ++r) {
        const size_t at = OnDevice::row_at(index, r, row::kCount);
        const double g = static_cast<double>(gradients[at]), rate = static_cast<double>(lesson.constants.rates[r]);
        if (!is_visible || rate == 0) {
          ASSERT_EQ(now(r), was(r));
          continue;
        }
        m[at] = 0.9 * m[at] + 0.1 * g;
        v[at] = 0.999 * v[at] + 0.001 * g * g;
        if (std::abs(g) < 1e-13) continue;  // squares leave the range of fp32
        const double n = visible[index];
        const double want =
            -rate * m[at] / (1 - std::pow(0.9, n)) / std::sqrt(v[at] / (1 - std::pow(0.999, n)) + 1e-30);
        ASSERT_NEAR(now(r) - was(r), want, 1e-4 * std::abs(want) + 5e-5 * rate + 1.2e-7 * std::abs(was(r)))
            << "step " << step << " row " << r;
      }
    }
    EXPECT_EQ(figures.visible, static_cast<uint32_t>(num_visible));
  }
}

TEST(CudaEngine, StepsAreTheSameInEveryRunAndWhereMemoryHasToGrow) {
  Scene scene;
  scene.count = 150;
  scene.log_scale_max = -0.3;  // large: far more instances than a first guess has room for
  scene.width = 300;
  scene.height = 200;
  scene.build(25);
  const Lesson lesson(scene);
  std::vector<std::vector<float>> results;
  for (int run = 0; run < 2; ++run) {
    OnDevice device(scene);
    if (run == 1) device.draw();  // it has grown before the first step
    DeviceLoss loss = lesson.loss;
    loss.ssim_weight = 0.2f;
    const Figures figures = device.engine.step(device.view, lesson.target, loss, lesson.constants, true);
    EXPECT_EQ(figures.lost, 0u);
    EXPECT_GT(figures.instances, 6u * 64 * static_cast<uint32_t>(device.num_blocks));
    results.push_back(device.rows());
  }
  EXPECT_EQ(results[0], results[1]);
}

#ifndef __CUDACC__
/// The host's stand-in for a race detector: see ThreadOrder.
TEST(CudaEngine, ResultsDoNotDependOnTheOrderOfThreadsAndBlocks) {
  Scene scene;
  scene.width = 50;
  scene.height = 39;
  scene.count = 300;
  scene.anchors = 3;
  scene.build(30);
  Lesson lesson(scene);
  std::vector<uint16_t> depth(scene.plane(), 2000);
  std::vector<uint8_t> mask(scene.plane(), 255);
  mask[77] = 0;
  lesson.target.depth = depth.data();
  lesson.target.mask = mask.data();
  lesson.target.depth_unit = 1e-3f;
  lesson.target.num_depth = static_cast<int>(scene.plane());
  lesson.loss.ssim_weight = 0.2f;
  lesson.loss.depth_weight = 0.1f;
  std::vector<float> want;
  for (const ThreadOrder order : {ThreadOrder::forwards, ThreadOrder::backwards, ThreadOrder::shuffled}) {
    OnDevice device(scene, kPlenty, HostDevice(order));
    device.draw();
    const Figures figures = device.engine.step(device.view, lesson.target, lesson.loss, lesson.constants, true);
    std::vector<float> got = device.rows();
    got.insert(got.end(), device.rgb.begin(), device.rgb.end());
    got.insert(got.end(), device.depth.begin(), device.depth.end());
    for (const ChannelSums& sums : figures.channels)
      for (const double sum : {sums.l1, sums.ssim, sums.mse, sums.bias, sums.value})
        got.push_back(static_cast<float>(sum));
    for (const double value : figures.pose) got.push_back(static_cast<float>(value));
    got.push_back(static_cast<float>(figures.depth));
    if (order == ThreadOrder::forwards) want = got;
    EXPECT_EQ(got, want) << static_cast<int>(order);
  }
}
#endif

TEST(CudaEngine, WhatFindsNoRoomIsTheFarthest) {
  Scene scene;
  scene.count = 150;
  scene.log_scale_max = -0.3;
  scene.width = 300;
  scene.height = 200;
  scene.build(25);
  OnDevice all(scene);
  all.draw();
  // What the image and the model take, and the first guess at instances; then some for half of what is missing.
  const uint64_t limit = all.engine.peak_bytes() * 3 / 4;
  OnDevice some(scene, limit);
  some.draw();
  EXPECT_GT(some.figures.lost, 0u);
  EXPECT_EQ(some.figures.instances + some.figures.lost, all.figures.instances);
  EXPECT_LE(some.engine.peak_bytes(), limit);
  for (size_t i = 0; i < scene.plane(); ++i) EXPECT_LE(some.alpha[i], all.alpha[i] + 1e-6f);
}

TEST(CudaEngine, ThereIsALimitToTheInstancesWhateverTheMemory) {
  Scene scene;
  scene.count = 80;
  scene.log_scale_max = -0.3;
  scene.width = 64;
  scene.height = 48;
  scene.build(25);
  const Lesson lesson(scene);
  OnDevice all(scene);
  all.draw();
  for (const uint32_t most : {200u, all.figures.instances - 1}) {
    OnDevice some(scene, kPlenty, TestDevice(), most);
    const Figures figures = some.engine.step(some.view, lesson.target, lesson.loss, lesson.constants, true);
    EXPECT_EQ(figures.instances, most);
    EXPECT_EQ(figures.lost, all.figures.instances - most);
    EXPECT_NE(some.rows(), all.rows()) << "no step was made";
  }
}

TEST(CudaEngine, OutOfMemoryLeavesTheModelAsItWas) {
  Scene scene;
  scene.build(26);
  const Lesson lesson(scene);
  OnDevice plenty(scene);
  const std::vector<float> want = plenty.rows();
  plenty.engine.step(plenty.view, lesson.target, lesson.loss, lesson.constants, true);
  const uint64_t peak = plenty.engine.peak_bytes();
  for (uint64_t limit = peak / 4; limit < peak; limit += peak / 16) {
    std::unique_ptr<OnDevice> device;
    try {
      device = std::make_unique<OnDevice>(scene, limit);
    } catch (const DeviceError& error) {
      EXPECT_TRUE(error.out_of_memory);
      continue;
    }
    try {
      device->engine.step(device->view, lesson.target, lesson.loss, lesson.constants, true);
    } catch (const DeviceError& error) {
      EXPECT_TRUE(error.out_of_memory);
      EXPECT_EQ(device->rows(), want);
    }
    EXPECT_LE(device->engine.peak_bytes(), limit);
  }
}

TEST(CudaEngine, TargetsGiveWayWhenMemoryIsShort) {
  Scene scene;
  scene.count = 64;
  scene.build(27);
  const Lesson lesson(scene);
  OnDevice roomy(scene);
  roomy.engine.step(roomy.view, lesson.target, lesson.loss, lesson.constants, false);
  const uint64_t one = roomy.engine.peak_bytes();
  OnDevice device(scene, one + 10 * scene.plane());  // a second target, no third
  DeviceTarget target = lesson.target;
  for (const uint64_t id : {1, 2, 3, 1, 4, 2}) {
    target.id = id;
    const Figures figures = device.engine.step(device.view, target, lesson.loss, lesson.constants, false);
    EXPECT_GT(figures.channels[0].l1, 0);
  }
  device.engine.forget_target(2);
  device.engine.forget_target(77);  // never seen
  EXPECT_NO_THROW(device.engine.step(device.view, target, lesson.loss, lesson.constants, false));
}

/// What block (x, y) of an image, not 0 where it counts, holds.
template <class T>
std::vector<T> values_of_block(const T* plane, int width, int factor, int x, int y) {
  std::vector<T> values;
  for (int i = 0; i < factor * factor; ++i)
    values.push_back(plane[(y * factor + i / factor) * width + x * factor + i % factor]);
  return values;
}

TEST(CudaEngine, SmallerTargetsAreMadeOfBlocks) {
  Random random(33);
  TestDevice device;
  Memory<TestDevice> memory(device, kPlenty);
  TargetCache<TestDevice> cache(device, memory);
  DeviceTarget target;
  for (const auto& [width, height, factor] :
       {std::tuple{8, 8, 8}, {37, 29, 2}, {50, 41, 3}, {67, 35, 4}, {90, 33, 8}}) {
    const size_t pixels = static_cast<size_t>(width * height);
    std::vector<uint8_t> rgb(3 * pixels), mask(pixels);
    std::vector<uint16_t> depth(pixels);
    for (uint8_t& value : rgb) value = static_cast<uint8_t>(random.index(256));
    for (uint8_t& value : mask) value = random.uniform() < 0.03 ? 0 : 1;
    for (uint16_t& value : depth)
      value = static_cast<uint16_t>(random.uniform() < 0.45 ? 0 : random.index(random.index(2) == 0 ? 65536 : 4));
    target = {.id = target.id + 1, .width = width, .height = height, .factor = factor, .rgb = rgb.data()};
    target.mask = mask.data();
    target.depth = depth.data();
    const auto& got = cache.get(target, factor, true);
    const int w = width / factor, h = height / factor;
    ASSERT_EQ(got.size.width, w);
    ASSERT_EQ(got.size.height, h);
    const size_t small = static_cast<size_t>(w * h);
    std::vector<uint8_t> got_rgb(3 * small), got_mask(small);
    std::vector<uint16_t> got_depth(small);
    device.download(got_rgb.data(), got.planes.rgb, 3 * small);
    device.download(got_mask.data(), got.planes.mask, small);
    device.download(got_depth.data(), got.planes.depth, 2 * small);
    int num_valid = 0, num_depth = 0;
    for (size_t i = 0; i < small; ++i) {
      const int x = static_cast<int>(i) % w, y = static_cast<int>(i) / w;
      for (size_t c = 0; c < 3; ++c) {
        double sum = 0;
        for (const uint8_t value : values_of_block(&rgb[c * pixels], width, factor, x, y)) sum += value;
        ASSERT_EQ(got_rgb[c * small + i], std::floor(sum / (factor * factor) + 0.5)) << width << " " << i;
      }
      const std::vector<uint8_t> block = values_of_block(mask.data(), width, factor, x, y);
      const bool valid = std::count(block.begin(), block.end(), 0) == 0;
      std::vector<uint16_t> measured = values_of_block(depth.data(), width, factor, x, y);
      std::erase(measured, 0);
      std::sort(measured.begin(), measured.end());
      const bool has_depth = valid && 2 * static_cast<int>(measured.size()) >= factor * factor;
      ASSERT_EQ(got_mask[i] != 0, valid) << width << " " << i;
      ASSERT_EQ(got_depth[i], has_depth ? measured[(measured.size() - 1) / 2] : 0) << width << " " << i;
      num_valid += valid ? 1 : 0;
      num_depth += has_depth ? 1 : 0;
    }
    EXPECT_EQ(got.num_valid, num_valid);
    EXPECT_EQ(got.num_depth, num_depth);
  }
}

TEST(CudaEngine, NothingToDrawIsTheBackground) {
  Scene scene;
  scene.count = 0;
  scene.width = 20;
  scene.height = 17;
  scene.build(28);
  const Lesson lesson(scene);
  OnDevice device(scene);
  device.draw();
  for (size_t i = 0; i < scene.plane(); ++i) {
    EXPECT_EQ(device.rgb[scene.plane() + i], scene.options.background[1]);
    EXPECT_EQ(device.alpha[i], 0);
  }
  const Figures figures = device.engine.step(device.view, lesson.target, lesson.loss, lesson.constants, true);
  EXPECT_EQ(figures.visible, 0u);
  EXPECT_EQ(figures.pose[0], 0);
}

/// Gives a gaussian values that nobody can draw.
void spoil(GaussianModel& model, size_t index, Random& random) {
  constexpr float kNan = NAN, kInf = INFINITY;
  constexpr std::pair<int, float> kValues[] = {
      {row::kMean, kNan},     {row::kMean + 1, kInf}, {row::kMean + 2, -kInf}, {row::kMean, 1e30f},
      {row::kRotation, kNan}, {row::kRotation, kInf}, {row::kLogScale, kNan},  {row::kLogScale + 1, 1e30f},
      {row::kLogScale, kInf}, {row::kOpacity, kNan},  {row::kOpacity, kInf},   {row::kOpacity, -kInf},
      {row::kSh, kNan},       {row::kSh + 47, kInf}};
  const auto& [parameter, value] = kValues[random.index(std::size(kValues))];
  model.block(index / kBlockSize).parameters[parameter][index % kBlockSize] = value;
}

/// Images of all sizes, models from empty to several blocks; what is not a number neither shows nor spreads.
TEST(CudaEngine, GarbageIsAsGoodAsNothing) {
  Random random(41);
  for (int round = 0; round < 8; ++round) {
    constexpr int kCounts[] = {0, 1, 2, 63, 64, 65, 90};
    const int width = 1 + random.index(40), height = 1 + random.index(34), count = kCounts[random.index(7)];
    const double share = round % 3 == 0 ? 1.0 : 0.3;
    Scene spoilt, plain;
    for (Scene* scene : {&spoilt, &plain}) {
      scene->width = width;
      scene->height = height;
      scene->count = count;
      scene->anchors = 1 + round % 2;
      scene->build(static_cast<uint64_t>(round));
    }
    std::vector<uint8_t> is_spoilt(spoilt.model.index_end());
    for (const size_t i : spoilt.indices) {
      if (random.uniform() > share) continue;
      is_spoilt[i] = 1;
      spoil(spoilt.model, i, random);
      plain.model.block(i / kBlockSize).parameters[row::kOpacity][i % kBlockSize] = -50;  // not to be seen
    }
    Lesson lesson(plain);
    lesson.loss.ssim_weight = 0.2f;
    OnDevice got(spoilt), want(plain);
    const std::vector<float> before = got.rows();
    const Figures a = got.engine.step(got.view, lesson.target, lesson.loss, lesson.constants, true);
    const Figures b = want.engine.step(want.view, lesson.target, lesson.loss, lesson.constants, true);
    got.read_image();
    want.read_image();
    EXPECT_EQ(got.rgb, want.rgb);
    EXPECT_EQ(got.depth, want.depth);
    EXPECT_EQ(got.alpha, want.alpha);
    EXPECT_EQ(a.visible, b.visible);
    EXPECT_EQ(a.instances, b.instances);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(a.pose[i], b.pose[i]);
    const std::vector<float> after = got.rows(), plain_after = want.rows();
    for (const size_t i : spoilt.indices)
      for (int r = 0; r < row::kTableRows; ++r) {
        const size_t at = OnDevice::row_at(i, r);
        const float expected = is_spoilt[i] != 0 ? before[at] : plain_after[at];
        ASSERT_EQ(std::memcmp(&after[at], &expected, sizeof(float)), 0) << round << ": " << i << " row " << r;
      }
  }
}

TEST(CudaEngine, ArrangementsMoveGaussiansWithAllThatBelongsToThem) {
  Scene scene;
  scene.count = 200;
  scene.build(29);
  OnDevice device(scene);
  const std::vector<float> before = device.rows();
  // Backwards in three blocks, every fifth dropped, one from the host; then one more block in place.
  std::vector<uint32_t> sources(3 * kBlockSize, ModelChanges::kFromNowhere);
  for (uint32_t i = 0; i < 150; ++i)
    if (i % 5 != 0) sources[i] = 199 - i;
  std::vector<float> records(row::kTableRows);
  std::iota(records.begin(), records.end(), 1.0f);
  sources[0] = ModelChanges::kFromHost;
  const std::vector<int32_t> anchors = {0, 0, 0, 0}, counts = {64, 64, 22, 1};
  Arrangement a;
  a.num_blocks = 3;
  a.sources = sources.data();
  a.anchors = anchors.data();
  a.counts = counts.data();
  a.records = records.data();
  a.num_records = 1;
  a.moves = true;
  device.engine.arrange(a);
  device.num_blocks = 3;
  const auto check = [&](const std::vector<float>& after) {
    for (uint32_t i = 0; i < 3 * kBlockSize; ++i)
      for (int r = 0; r < row::kTableRows; ++r) {
        const float want = i == 0                                     ? static_cast<float>(r + 1)
                           : sources[i] == ModelChanges::kFromNowhere ? 0.0f
                                                                      : before[OnDevice::row_at(sources[i], r)];
        ASSERT_EQ(after[OnDevice::row_at(i, r)], want) << i << " row " << r;
      }
  };
  check(device.rows());
  std::vector<uint32_t> stay(4 * kBlockSize, ModelChanges::kFromNowhere);
  std::iota(stay.begin(), stay.begin() + 3 * kBlockSize, 0u);
  stay[3 * kBlockSize] = ModelChanges::kFromHost;
  a.num_blocks = 4;
  a.sources = stay.data();
  a.moves = false;
  device.engine.arrange(a);
  device.num_blocks = 4;
  const std::vector<float> after = device.rows();
  check(after);
  EXPECT_EQ(after[OnDevice::row_at(3 * kBlockSize, 5)], 6);
}

TEST(CudaEngine, FatesAndChildrenAreThoseOfTheHost) {
  Scene scene;
  scene.count = 200;
  scene.build(31);
  Random random(32);
  std::vector<float> opacities, sizes;
  scene.model.for_each([&](size_t i) {
    const Gaussian g = scene.model.get(i);
    opacities.push_back(g.opacity_logit);
    sizes.push_back(*std::max_element(g.log_scale, g.log_scale + 3));
  });
  std::sort(opacities.begin(), opacities.end());
  std::sort(sizes.begin(), sizes.end());
  DensityRules rules;
  rules.by_shape = rules.by_statistics = true;
  rules.min_opacity_logit = opacities[10];
  rules.max_log_scale = sizes[180];
  rules.min_weight = 0.2;
  rules.gradient_threshold = 0.1;
  rules.split_log_scale = static_cast<double>(sizes[90]);
  scene.model.for_each([&](size_t i) {
    Block& block = scene.model.block(i / kBlockSize);
    const size_t lane = i % kBlockSize;
    block.visible[lane] = static_cast<float>(random.index(6));
    block.gradient[lane] = static_cast<float>(random.uniform());
    block.max_weight[lane] = static_cast<float>(random.uniform());
  });
  scene.model.block(0).parameters[row::kMean][5] = INFINITY;
  OnDevice device(scene);
  std::vector<Fate> fates(device.num_blocks * kBlockSize);
  device.engine.judge(rules, fates.data());
  size_t counts[4] = {};
  for (const size_t i : scene.indices) {
    EXPECT_EQ(fates[i], judge(rules, scene.model.block(i / kBlockSize), static_cast<int>(i % kBlockSize))) << i;
    ++counts[static_cast<size_t>(fates[i])];
  }
  for (const size_t count : counts) EXPECT_GT(count, 3u);
  EXPECT_EQ(fates[5], Fate::goes);

  const std::vector<float> before = device.rows();
  std::vector<Child> children(kBlockSize + 6);
  for (Child& child : children) {
    child.parent = static_cast<uint32_t>(scene.indices[static_cast<size_t>(random.index(200))]);
    child.is_half = static_cast<uint32_t>(random.index(2));
    for (double& n : child.normals) n = random.normal();
  }
  const size_t first = device.num_blocks * kBlockSize;
  device.engine.breed(children.data(), static_cast<uint32_t>(children.size()));
  device.num_blocks += 2;
  const std::vector<float> after = device.rows();
  EXPECT_TRUE(std::equal(before.begin(), before.end(), after.begin()));
  for (size_t k = 0; k < 2 * kBlockSize; ++k) {
    float want[row::kTableRows] = {};
    if (k < children.size()) {
      for (int r = 0; r < row::kCount; ++r) want[r] = before[OnDevice::row_at(children[k].parent, r)];
      if (children[k].is_half != 0) halve(children[k].normals, want, 1);
    }
    for (int r = 0; r < row::kTableRows; ++r) {
      const float got = after[OnDevice::row_at(first + k, r)];
      ASSERT_TRUE(got == want[r] || std::abs(got - want[r]) <= 1e-6f * (1 + std::abs(want[r]))) << k << " row " << r;
    }
  }
}

}  // namespace
}  // namespace photoslam::splatting::cuda

#endif  // __SANITIZE_THREAD__
