// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/trainer.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

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

std::vector<float> all_parameters(const GaussianModel& model) {
  std::vector<float> values;
  for (size_t b = 0; b < model.num_blocks(); ++b)
    values.insert(values.end(), &model.block(b).parameters[0][0], &model.block(b).parameters[0][0] + row::kCount * kBlockSize);
  return values;
}

class Training : public ::testing::TestWithParam<int64_t> {
 protected:
  testing::ScopedSimdTarget target_{GetParam()};
  SerialExecutor executor_;
};

INSTANTIATE_TEST_SUITE_P(Simd, Training, ::testing::ValuesIn(testing::simd_targets()),
                         [](const auto& p) { return testing::simd_target_name(p.param); });

TEST_P(Training, StepIsAdamOnTheGradientsOfTheLoss) {
  Scene scene;
  scene.build(21);
  const TargetImage target = random_target(scene.width, scene.height, 22);
  TrainOptions options;
  options.render = scene.options;
  options.opacity_weight = 0.01f;
  Trainer trainer, oracle;
  LossFunction loss;
  const LearningRates& rates = options.rates;
  std::vector<double> m(scene.indices.size() * row::kCount), v(m.size()), n(scene.indices.size());
  for (int step = 1; step <= 4; ++step) {
    oracle.forward(scene.model, scene.view, options.render, executor_);
    std::vector<float> dl_drgb;
    loss.evaluate(oracle.rendered().rgb, target, options.ssim_weight, {}, executor_, dl_drgb);
    Gradients gradients;
    oracle.backward(scene.model, dl_drgb, {}, {}, executor_, gradients);
    const std::vector<float> before = all_parameters(scene.model);
    const StepResult result = trainer.step(scene.model, scene.view, target, options, executor_);
    for (size_t i = 0; i < scene.indices.size(); ++i) {
      const size_t index = scene.indices[i], lane = index % kBlockSize;
      const bool visible = scene.model.statistics(index).visible == static_cast<float>(n[i] + 1);
      if (!visible) continue;
      ++n[i];
      for (int r = 0; r < row::kCount; ++r) {
        double g = static_cast<double>(gradients.at(index, r));
        if (r == row::kOpacity) {
          const double o = 1 / (1 + std::exp(-static_cast<double>(before[(index / kBlockSize * row::kCount + row::kOpacity) * kBlockSize + lane])));
          g += 0.01 / result.visible * o * (1 - o);
        }
        const float rate = r < 3 ? rates.mean : r < 7 ? rates.rotation : r < 10 ? rates.log_scale : r < 11 ? rates.opacity : r < 14 ? rates.sh_dc : rates.sh_rest;
        const size_t at = i * row::kCount + static_cast<size_t>(r);
        m[at] = 0.9f * m[at] + (1 - 0.9f) * g;
        v[at] = 0.999f * v[at] + (1 - static_cast<double>(0.999f)) * g * g;
        const double change = -rate * (m[at] / (1 - std::pow(static_cast<double>(0.9f), n[i]))) /
                              (std::sqrt(v[at] / (1 - std::pow(static_cast<double>(0.999f), n[i]))) + 1e-15);
        const size_t p = (index / kBlockSize * row::kCount + static_cast<size_t>(r)) * kBlockSize + lane;
        const double got = static_cast<double>(all_parameters(scene.model)[p]) - static_cast<double>(before[p]);
        // The parameter itself is rounded to fp32.
        const double rounding = 1.3e-7 * std::abs(static_cast<double>(before[p]));
        if (std::abs(g) > 1e-12 && i % 7 == 0) ASSERT_NEAR(got, change, 2e-3 * static_cast<double>(rate) + rounding) << "step " << step << " row " << r;
      }
    }
  }
}

}  // namespace
}  // namespace photoslam::splatting
