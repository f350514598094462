// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/trainer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/check.h"
#include "splatting/testing/scenes.h"
#include "splatting/testing/simd_targets.h"

namespace photoslam::splatting {
namespace {

using testing::Scene;

TargetImage random_target(int width, int height, uint64_t seed) {
  Random random(seed);
  std::vector<uint8_t> rgb(static_cast<size_t>(width) * static_cast<size_t>(height) * 3);
  for (uint8_t& v : rgb) v = static_cast<uint8_t>(random.index(256));
  return {width, height, rgb};
}

TargetImage target_of(const RenderResult& image) {
  const size_t plane = image.alpha.size();
  std::vector<uint8_t> rgb(3 * plane);
  for (size_t i = 0; i < plane; ++i)
    for (size_t c = 0; c < 3; ++c)
      rgb[3 * i + c] = static_cast<uint8_t>(std::lround(255 * std::clamp(image.rgb[c * plane + i], 0.0f, 1.0f)));
  return {image.width, image.height, rgb};
}

/// Every parameter of every gaussian, in the order of indices.
std::vector<float> all_parameters(const GaussianModel& model) {
  std::vector<float> values;
  model.for_each([&](size_t index) {
    for (const auto& parameter : model.block(index / kBlockSize).parameters)
      values.push_back(parameter[index % kBlockSize]);
  });
  return values;
}

float rate_of(const LearningRates& rates, int parameter_row) {
  if (parameter_row < row::kRotation) return rates.mean;
  if (parameter_row < row::kLogScale) return rates.rotation;
  if (parameter_row < row::kOpacity) return rates.log_scale;
  if (parameter_row < row::kSh) return rates.opacity;
  return parameter_row < row::kSh + 3 ? rates.sh_dc : rates.sh_rest;
}

/// Scalar Adam in double precision, one state per parameter.
struct Adam {
  double m = 0, v = 0;
  int n = 0;
  double step(double gradient, const TrainOptions& options, float rate) {
    const double b1 = static_cast<double>(options.beta1), b2 = static_cast<double>(options.beta2);
    ++n;
    m = b1 * m + (1 - b1) * gradient;
    v = b2 * v + (1 - b2) * gradient * gradient;
    const double m_hat = options.bias_correction ? m / (1 - std::pow(b1, n)) : m;
    const double v_hat = options.bias_correction ? v / (1 - std::pow(b2, n)) : v;
    return -static_cast<double>(rate) * m_hat / std::sqrt(v_hat + std::pow(static_cast<double>(options.epsilon), 2));
  }
};

class Training : public ::testing::TestWithParam<int64_t> {
 protected:
  testing::ScopedSimdTarget simd_target{GetParam()};
  SerialExecutor executor;
};

INSTANTIATE_TEST_SUITE_P(Simd, Training, ::testing::ValuesIn(testing::simd_targets()),
                         [](const auto& p) { return testing::simd_target_name(p.param); });

TEST_P(Training, StepIsAdamOnTheGradientsOfTheLoss) {
  for (const bool bias_correction : {true, false}) {
    Scene scene;
    scene.build(21);
    const TargetImage target = random_target(scene.width, scene.height, 22);
    TrainOptions options;
    options.render = scene.options;
    options.bias_correction = bias_correction;
    Trainer trainer, plain;
    LossFunction loss;
    std::vector<Adam> adam(scene.indices.size() * row::kCount);
    for (int step = 1; step <= 4; ++step) {
      plain.forward(scene.model, scene.view, options.render, executor);
      std::vector<float> dl_drgb;
      loss.evaluate(plain.rendered().rgb, target, options.ssim_weight, {}, executor, dl_drgb);
      Gradients gradients;
      plain.backward(scene.model, dl_drgb, {}, {}, executor, gradients);
      const std::vector<float> before = all_parameters(scene.model);
      scene.model.reset_statistics();
      trainer.step(scene.model, scene.view, target, options, executor);
      const std::vector<float> after = all_parameters(scene.model);
      for (size_t i = 0; i < after.size(); ++i) {
        const size_t index = i / row::kCount;  // one anchor: indices are dense
        const int r = static_cast<int>(i % row::kCount);
        if (scene.model.statistics(index).visible == 0) {
          ASSERT_EQ(after[i], before[i]);
          continue;
        }
        const double g = static_cast<double>(gradients.at(index, r));
        const float rate = rate_of(options.rates, r);
        const double want = adam[i].step(g, options, rate);
        const double got = static_cast<double>(after[i]) - static_cast<double>(before[i]);
        const double rounding = 1.2e-7 * std::abs(static_cast<double>(before[i]));
        if (std::abs(g) < 1e-15) continue;  // squares leave the range of fp32
        ASSERT_NEAR(got, want, 1e-4 * std::abs(want) + 5e-5 * static_cast<double>(rate) + rounding)
            << "step " << step << " row " << r;
      }
    }
  }
}

TEST_P(Training, FitsAnImage) {
  Scene scene;
  scene.build(23);
  Renderer renderer;
  RenderResult image;
  renderer.render(scene.model, scene.view, scene.options, executor, image);
  const TargetImage target = target_of(image);
  Random random(24);
  for (size_t index : scene.indices) {
    Gaussian g = scene.model.get(index);
    for (float& m : g.mean) m += static_cast<float>(0.01 * random.normal());
    for (float& s : g.log_scale) s += static_cast<float>(0.2 * random.normal());
    for (float& c : g.sh[0]) c += static_cast<float>(0.5 * random.normal());
    scene.model.set(index, g);
  }
  Trainer trainer;
  TrainOptions options;
  options.render = scene.options;
  options.rates.mean = 1e-3f;
  options.rates.sh_dc = 2e-2f;
  const StepResult first = trainer.step(scene.model, scene.view, target, options, executor);
  StepResult last;
  for (int i = 0; i < 150; ++i) last = trainer.step(scene.model, scene.view, target, options, executor);
  EXPECT_LT(last.loss, 0.25f * first.loss);
  EXPECT_LT(last.mse, 0.05f * first.mse);
}

TEST_P(Training, ResultsDoNotDependOnTheNumberOfThreads) {
  const auto run = [&](int threads) {
    Scene scene;
    scene.anchors = 3;
    scene.count = 2000;
    scene.build(25);
    TargetImage target = random_target(scene.width, scene.height, 26);
    target.set_depth(std::vector<float>(scene.plane(), 2.0f));
    TrainOptions options;
    options.render = scene.options;
    options.depth_weight = 0.1f;
    ThreadPool pool(threads);
    Trainer trainer;
    std::vector<float> out;
    for (int i = 0; i < 5; ++i) {
      const StepResult r = trainer.step(scene.model, scene.view, target, options, pool);
      out.insert(out.end(), {r.loss, r.ssim, r.mse, r.depth});
      out.insert(out.end(), r.pose_gradient, r.pose_gradient + 6);
      out.insert(out.end(), r.exposure_gradient, r.exposure_gradient + 6);
    }
    const std::vector<float> parameters = all_parameters(scene.model);
    out.insert(out.end(), parameters.begin(), parameters.end());
    return out;
  };
  const std::vector<float> one = run(1);
  for (const int threads : {2, 3}) {
    const std::vector<float> many = run(threads);
    ASSERT_EQ(many.size(), one.size());
    for (size_t i = 0; i < one.size(); ++i)
      ASSERT_EQ(std::bit_cast<uint32_t>(many[i]), std::bit_cast<uint32_t>(one[i]));
  }
}

TEST_P(Training, FrozenGroupsAndUnusedDegreesStay) {
  Scene scene;
  scene.build(27);
  scene.model.set_sh_degree(1);
  const TargetImage target = random_target(scene.width, scene.height, 28);
  TrainOptions options;
  options.render = scene.options;
  options.rates.mean = options.rates.opacity = 0;
  Trainer trainer;
  const std::vector<float> before = all_parameters(scene.model);
  trainer.step(scene.model, scene.view, target, options, executor);
  const std::vector<float> after = all_parameters(scene.model);
  std::vector<int> changed(row::kCount);
  for (size_t i = 0; i < before.size(); ++i) changed[i % row::kCount] += before[i] != after[i];
  for (int r = 0; r < row::kCount; ++r) {
    const bool frozen = r < row::kRotation || r == row::kOpacity || r >= row::kSh + 3 * num_sh_coefficients(1);
    EXPECT_EQ(changed[static_cast<size_t>(r)] == 0, frozen) << "row " << r;
  }
}

TEST_P(Training, WithoutUpdateOnlyReports) {
  Scene scene;
  scene.build(29);
  const TargetImage target = random_target(scene.width, scene.height, 30);
  TrainOptions options;
  options.render = scene.options;
  options.update = false;
  Trainer trainer;
  const std::vector<float> before = all_parameters(scene.model);
  const StepResult result = trainer.step(scene.model, scene.view, target, options, executor);
  EXPECT_EQ(before, all_parameters(scene.model));
  EXPECT_EQ(scene.model.statistics(scene.indices[0]).visible, 0);
  EXPECT_NE(result.pose_gradient[0], 0);
  EXPECT_GT(result.visible, 0);
}

TEST_P(Training, OpacityWeightLowersOpacities) {
  Scene scene;
  scene.build(33);
  Renderer renderer;
  RenderResult image;
  renderer.render(scene.model, scene.view, scene.options, executor, image);
  TrainOptions options;
  options.render = scene.options;
  options.opacity_weight = 1e3f;  // drowns the image
  Trainer trainer;
  const std::vector<float> before = all_parameters(scene.model);
  trainer.step(scene.model, scene.view, target_of(image), options, executor);
  const std::vector<float> after = all_parameters(scene.model);
  for (size_t i = row::kOpacity; i < after.size(); i += row::kCount)
    if (scene.model.statistics(i / row::kCount).visible > 0) {
      // Adam's first step is the rate against the gradient's sign.
      ASSERT_NEAR(after[i] - before[i], -options.rates.opacity, 1e-5f);
    }
}

TEST_P(Training, DepthLossMovesGaussiansTowardsTheMeasuredDepth) {
  GaussianModel model;
  model.add_anchor();
  Gaussian g;
  g.mean[2] = 2;
  for (float& s : g.log_scale) s = 0;
  g.opacity_logit = 2;
  model.add(0, {&g, 1});
  const std::vector<Pose> poses(1);
  TargetImage target(16, 16, std::vector<uint8_t>(16 * 16 * 3, 128));
  target.set_depth(std::vector<float>(256, 3.0f));
  TrainOptions options;
  options.depth_weight = 1;
  options.rates.mean = 0.01f;
  Trainer trainer;
  StepResult result;
  for (int i = 0; i < 120; ++i)
    result = trainer.step(model, {{16, 16, 16, 16, 8, 8}, poses}, target, options, executor);
  EXPECT_NEAR(model.get(0).mean[2], 3, 0.05);
  EXPECT_LT(result.depth, 0.05f);
}

TEST_P(Training, PoisonLeavesTheRestClean) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  const auto render = [&](const GaussianModel& model, const Scene& scene) {
    Renderer renderer;
    RenderResult image;
    renderer.render(model, scene.view, scene.options, executor, image);
    return image;
  };
  Scene scene;
  scene.build(31);
  const RenderResult clean = render(scene.model, scene);
  for (int r = 0; r < row::kCount; ++r)
    for (const float poison : {kNan, kInf, -kInf, 1e38f}) {
      if (r == row::kOpacity && poison > 0) continue;  // a sane opacity of 1
      Gaussian g = scene.model.get(scene.indices[0]);
      float* values[] = {g.mean, g.rotation, g.log_scale, &g.opacity_logit, &g.sh[0][0]};
      const int begins[] = {row::kMean, row::kRotation, row::kLogScale, row::kOpacity, row::kSh, row::kCount};
      for (int i = 0; i < 5; ++i)
        if (r >= begins[i] && r < begins[i + 1]) values[i][r - begins[i]] = poison;
      scene.model.add(0, {&g, 1});
    }
  Gaussian zero_quaternion = scene.model.get(scene.indices[0]);
  std::fill_n(zero_quaternion.rotation, 4, 0.0f);
  scene.model.add(0, {&zero_quaternion, 1});
  Gaussian endless = scene.model.get(scene.indices[0]);
  std::fill_n(endless.log_scale, 3, 1e38f);
  scene.model.add(0, {&endless, 1});

  const RenderResult poisoned = render(scene.model, scene);
  EXPECT_EQ(poisoned.rgb, clean.rgb);
  EXPECT_EQ(poisoned.depth, clean.depth);
  Trainer trainer;
  TrainOptions options;
  options.render = scene.options;
  for (int i = 0; i < 3; ++i)
    trainer.step(scene.model, scene.view, random_target(scene.width, scene.height, 32), options, executor);
  const RenderResult trained = render(scene.model, scene);
  for (float v : trained.rgb) ASSERT_TRUE(std::isfinite(v));
}

TEST_P(Training, PoisonedCamerasShowTheBackground) {
  Scene scene;
  scene.build(34);
  Trainer trainer;
  TrainOptions options;
  options.render = scene.options;
  const TargetImage target = random_target(scene.width, scene.height, 35);
  const std::vector<float> before = all_parameters(scene.model);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  for (const float poison : {kNan, kInf, -kInf, 1e38f})
    for (int member = 0; member < 6; ++member) {
      std::vector<Pose> poses = scene.poses;
      View view{scene.view.camera, poses};
      float* const intrinsics[] = {&view.camera.fx, &view.camera.fy, &view.camera.cx, &view.camera.cy};
      for (Pose& pose : poses) {
        if (member == 4) pose.rotation[0] = static_cast<double>(poison);
        if (member == 5) pose.translation[2] = static_cast<double>(poison);
      }
      if (member < 4) *intrinsics[member] = poison;
      const StepResult result = trainer.step(scene.model, view, target, options, executor);
      EXPECT_EQ(result.visible, 0) << poison << " in member " << member;
      EXPECT_TRUE(std::isfinite(result.loss));
      for (float gradient : result.pose_gradient) EXPECT_EQ(gradient, 0);
    }
  EXPECT_EQ(before, all_parameters(scene.model));
}

TEST_P(Training, ManyInOneTileSortByDepthThenIndex) {
  // Pairs at equal depth: the one with the lower index hides the other.
  Random random(36);
  std::vector<Gaussian> gaussians(20000);
  for (size_t i = 0; i < gaussians.size(); ++i) {
    Gaussian& g = gaussians[i];
    g.mean[2] = i % 2 == 0 ? static_cast<float>(random.uniform(1, 50)) : gaussians[i - 1].mean[2];
    for (float& s : g.log_scale) s = 3;
    g.opacity_logit = -5;
    g.sh[0][0] = i % 2 == 0 ? 1.0f : -1.0f;
  }
  GaussianModel model;
  model.add_anchor();
  model.add(0, gaussians);
  const std::vector<Pose> poses(1);
  Renderer renderer;
  RenderResult image;
  renderer.render(model, {{1, 1, 1, 1, 0, 0}, poses}, {}, executor, image);
  std::vector<size_t> order(gaussians.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return gaussians[a].mean[2] < gaussians[b].mean[2]; });
  double left = 1, red = 0, depth = 0;
  for (const size_t i : order) {
    const double z = static_cast<double>(gaussians[i].mean[2]), alpha = 1 / (1 + std::exp(5.0));
    if (left * (1 - alpha) <= 1e-4) break;
    red += left * alpha * std::max(0.0, 0.5 + 0.28209479177387814 * static_cast<double>(gaussians[i].sh[0][0]));
    depth += left * alpha * z;
    left *= 1 - alpha;
  }
  EXPECT_NEAR(image.rgb[0], red, 2e-5);
  EXPECT_NEAR(image.depth[0], depth, 2e-3);
}

TEST_P(Training, DegenerateSizesWork) {
  Trainer trainer;
  GaussianModel model;
  const std::vector<Pose> poses(1);
  const View view{{1, 1, 1, 1, 0, 0}, poses};
  const TargetImage target(1, 1, std::vector<uint8_t>{10, 20, 30});
  EXPECT_EQ(trainer.step(model, view, target, {}, executor).visible, 0);  // no anchors, no gaussians
  model.add_anchor();
  EXPECT_EQ(trainer.step(model, view, target, {}, executor).visible, 0);
  std::vector<Gaussian> same(5000);
  for (Gaussian& g : same) g.mean[2] = 1;
  model.add(0, same);
  const StepResult result = trainer.step(model, view, target, {}, executor);
  EXPECT_EQ(result.visible, 5000);
  EXPECT_TRUE(std::isfinite(result.loss));
  const TargetImage no_data(1, 1, std::vector<uint8_t>{10, 20, 30}, std::vector<uint8_t>{0});
  EXPECT_TRUE(std::isfinite(trainer.step(model, view, no_data, {}, executor).loss));
}

TEST(Trainer, RejectsMismatchedSizes) {
  Trainer trainer;
  GaussianModel model;
  model.add_anchor();
  SerialExecutor executor;
  const std::vector<Pose> poses(1);
  const TargetImage target(4, 4, std::vector<uint8_t>(48));
  EXPECT_THROW(trainer.step(model, {{5, 4, 1, 1, 0, 0}, poses}, target, {}, executor), CheckError);
  EXPECT_THROW(trainer.step(model, {{4, 4, 1, 1, 0, 0}, {}}, target, {}, executor), CheckError);
}

}  // namespace
}  // namespace photoslam::splatting
