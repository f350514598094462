// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/loss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "splatting/testing/reference_loss.h"
#include "splatting/testing/simd_targets.h"

namespace photoslam::splatting {
namespace {

using Case = reference::LossCase;
using reference::make_loss_case;
using reference::photometric_loss;

class Loss : public ::testing::TestWithParam<int64_t> {
 protected:
  PhotometricLoss evaluate(const Case& c, float lambda, std::vector<float>& gradient) {
    const std::vector<float> render(c.render.begin(), c.render.end());
    LossFunction loss;
    SerialExecutor executor;
    Exposure exposure;
    std::copy_n(c.gain, 3, exposure.gain);
    std::copy_n(c.bias, 3, exposure.bias);
    return loss.evaluate(render, TargetImage(c.width, c.height, c.target, c.mask), lambda, exposure, executor,
                         gradient);
  }
  testing::ScopedSimdTarget simd_target{GetParam()};
};

INSTANTIATE_TEST_SUITE_P(Simd, Loss, ::testing::ValuesIn(testing::simd_targets()),
                         [](const auto& p) { return testing::simd_target_name(p.param); });

TEST_P(Loss, ValueEqualsTheDefinition) {
  for (const auto& [w, h] : {std::pair{37, 29}, {64, 120}, {1, 1}, {5, 3}, {16, 100}})
    for (const bool masked : {false, true}) {
      const Case c = make_loss_case(w, h, masked && w > 5, 3);
      std::vector<float> gradient;
      double ssim = 0;
      const double want = photometric_loss(c, 0.2, c.render, &ssim);
      const PhotometricLoss got = evaluate(c, 0.2f, gradient);
      EXPECT_NEAR(got.loss, want, 2e-6) << w << "x" << h;
      EXPECT_NEAR(got.ssim, ssim, 1e-5) << w << "x" << h;
      EXPECT_NEAR(evaluate(c, 0.0f, gradient).loss, photometric_loss(c, 0, c.render), 1e-6);
    }
}

TEST_P(Loss, GradientAgreesWithFiniteDifferences) {
  for (const bool masked : {false, true})
    for (const double lambda : {0.0, 0.2, 1.0}) {
      const Case c = make_loss_case(18, 103, masked, 7);
      std::vector<float> gradient;
      evaluate(c, static_cast<float>(lambda), gradient);
      ASSERT_EQ(gradient.size(), c.render.size());
      EXPECT_LE(reference::gradient_error(c, lambda, gradient), 1e-4) << "lambda " << lambda << " masked " << masked;
    }
}

TEST_P(Loss, ExposureGradientAgreesWithFiniteDifferences) {
  const Case c = make_loss_case(40, 30, true, 9);
  std::vector<float> gradient;
  const PhotometricLoss got = evaluate(c, 0.2f, gradient);
  for (size_t k = 0; k < 6; ++k) {
    const auto moved = [&](float step) {
      Case other = c;
      (k < 3 ? other.gain[k] : other.bias[k - 3]) += step;
      return photometric_loss(other, 0.2, other.render);
    };
    const double numeric = (moved(1e-4f) - moved(-1e-4f)) / 2e-4;
    EXPECT_NEAR(static_cast<double>(got.exposure_gradient[k]), numeric, 2e-3 * std::abs(numeric) + 1e-4) << k;
  }
}

TEST_P(Loss, PixelsWithoutDataHaveNoGradient) {
  const Case c = make_loss_case(40, 30, true, 10);
  std::vector<float> gradient;
  evaluate(c, 0.2f, gradient);
  for (size_t i = 0; i < c.render.size(); ++i) ASSERT_TRUE(c.mask[i % c.plane()] != 0 || gradient[i] == 0.0f) << i;
}

TEST(DepthLoss, ComparesWithTheDepthThatTheOpacityAllows) {
  // D = 1.5, A = 0.5, d = 2: residual 0.5; a pixel without depth does not count.
  TargetImage target(2, 1, std::vector<uint8_t>(6));
  target.set_depth(std::vector<uint16_t>{2000, 0}, 1e-3f);
  std::vector<float> by_depth, by_alpha;
  EXPECT_NEAR(depth_loss(std::vector<float>{1.5f, 9}, std::vector<float>{0.5f, 1}, target, 3, by_depth, by_alpha), 0.5,
              1e-6);
  EXPECT_EQ(by_depth, (std::vector<float>{3, 0}));
  EXPECT_EQ(by_alpha, (std::vector<float>{-6, -0.0f}));
}

TEST(TargetImage, KeepsDepthWithinHalfAStep) {
  TargetImage target(3, 1, std::vector<uint8_t>(9));
  target.set_depth(std::vector<float>{4.0f, -1.0f, 1.2345f});
  EXPECT_EQ(target.num_depth(), 2);
  EXPECT_EQ(target.depth()[1], 0);
  EXPECT_NEAR(static_cast<float>(target.depth()[2]) * target.depth_unit(), 1.2345, 0.51 * 4.0 / 65535);
}

}  // namespace
}  // namespace photoslam::splatting
