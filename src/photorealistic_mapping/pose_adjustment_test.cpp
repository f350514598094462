// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/pose_adjustment.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <numbers>

namespace photoslam {
namespace {

TEST(PoseAdjustment, DescendsToTheMinimum) {
  // L = |t|² + |ω|² of the composed pose correction * start, whose minimum is the identity.
  PoseAdjustmentOptions options;
  PoseAdjustment adjustment;
  const SE3 start(so3_exp(Vec3(0.002, -0.001, 0.0015)), Vec3(0.01, -0.02, 0.005));
  for (int i = 0; i < 600; ++i) {
    const SE3 pose = adjustment.correction() * start;
    const Vec3 omega = so3_log(pose.rotation);
    std::array<float, 6> gradient{};
    // d/dξ of |exp(ξ) T|²: translation moves by v + ω × t.
    const Vec3 dt = 2 * pose.translation, dw = 2 * omega + 2 * pose.translation.cross(pose.translation);
    for (size_t k = 0; k < 3; ++k) {
      gradient[k] = static_cast<float>(dt[static_cast<int>(k)]);
      gradient[k + 3] = static_cast<float>(dw[static_cast<int>(k)]);
    }
    adjustment.step(options, 1.0, 1.0 - i / 600.0, gradient);
  }
  const SE3 end = adjustment.correction() * start;
  EXPECT_LT(end.translation.norm(), 0.1 * start.translation.norm());
  EXPECT_LT(so3_log(end.rotation).norm(), 0.1 * so3_log(start.rotation).norm());
}

TEST(PoseAdjustment, TheFirstStepHasTheConfiguredSize) {
  PoseAdjustmentOptions options;
  PoseAdjustment adjustment;
  adjustment.step(options, 3.0, 0.5, std::array<float, 6>{7, 0, 0, 0, -2, 0});
  EXPECT_NEAR(adjustment.correction().translation.x(), -0.5 * 3.0 * options.translation_rate, 1e-9);
  EXPECT_NEAR(so3_log(adjustment.correction().rotation).y(), 0.5 * options.rotation_rate_deg * std::numbers::pi / 180,
              1e-9);
}

TEST(PoseAdjustment, ABrokenGradientIsIgnored) {
  PoseAdjustment adjustment;
  adjustment.step({}, 1.0, 1.0, std::array<float, 6>{std::numeric_limits<float>::quiet_NaN()});
  EXPECT_EQ(adjustment.correction().translation, Vec3::Zero());
}

}  // namespace
}  // namespace photoslam
