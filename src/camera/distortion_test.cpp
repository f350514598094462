// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "camera/distortion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace photoslam {
namespace {

// A strongly distorting consumer depth camera and a wide-angle stereo camera.
constexpr Distortion kDepthCamera = {.k1 = 0.262383, .k2 = -0.953104, .p1 = -0.005358, .p2 = 0.002628, .k3 = 1.163314};
constexpr Distortion kWideAngle = {
    .k1 = -0.28340811, .k2 = 0.07395907, .p1 = 0.00019359, .p2 = 1.76187114e-05, .k3 = 0};
// A phone with the rational model, and a fisheye of about 150°.
constexpr Distortion kRational = {
    .k1 = 0.35, .k2 = -1.9, .p1 = 4e-4, .p2 = -3e-4, .k3 = 1.1, .k4 = 0.22, .k5 = -1.7, .k6 = 0.9};
constexpr Distortion kFisheye = {
    .k1 = -0.012, .k2 = 0.021, .k3 = -0.015, .k4 = 0.003, .model = LensModel::kannala_brandt};

TEST(Distortion, FollowsTheModelOfOpenCv) {
  // cv::projectPoints of the point (0.3, -0.2, 1) with unit intrinsics, worked out term by term:
  // r² = 0.13; radial = 1 + 0.13 k1 + 0.0169 k2 + 0.002197 k3.
  const Distortion d = {.k1 = 0.1, .k2 = -0.2, .p1 = 0.01, .p2 = -0.02, .k3 = 0.3};
  const double radial = 1 + 0.013 - 0.00338 + 0.0006591;
  const Vec2 expected(0.3 * radial + 2 * 0.01 * -0.06 - 0.02 * (0.13 + 0.18),
                      -0.2 * radial + 0.01 * (0.13 + 0.08) + 2 * -0.02 * -0.06);
  EXPECT_LT((distort(d, Vec2(0.3, -0.2)) - expected).norm(), 1e-15);
}

TEST(Distortion, FollowsTheRationalModelOfOpenCv) {
  const Distortion d = {.k1 = 0.1, .k2 = -0.2, .k3 = 0.3, .k4 = 0.4, .k5 = -0.5, .k6 = 0.6};
  const double radial = (1 + 0.013 - 0.00338 + 0.0006591) / (1 + 0.052 - 0.00845 + 0.0013182);
  EXPECT_LT((distort(d, Vec2(0.3, -0.2)) - radial * Vec2(0.3, -0.2)).norm(), 1e-15);
}

TEST(Distortion, FollowsTheFisheyeOfKannalaAndBrandt) {
  // A ray at 45° to the axis, along the diagonal: the radius of its image is the polynomial of the angle.
  const double a = std::atan(1.0);
  const double radius = a * (1 + kFisheye.k1 * std::pow(a, 2) + kFisheye.k2 * std::pow(a, 4) +
                             kFisheye.k3 * std::pow(a, 6) + kFisheye.k4 * std::pow(a, 8));
  const Vec2 direction = Vec2(3, 4) / 5;
  EXPECT_LT((distort(kFisheye, direction) - radius * direction).norm(), 1e-15);
  EXPECT_FALSE((Distortion{.model = LensModel::kannala_brandt}.none()));
}

TEST(Distortion, FisheyeIsSmoothAtTheAxis) {
  Eigen::Matrix2d at_axis, beside;
  EXPECT_EQ(distort(kFisheye, Vec2::Zero(), &at_axis), Vec2(Vec2::Zero()));
  EXPECT_EQ(at_axis, Eigen::Matrix2d(Eigen::Matrix2d::Identity()));
  distort(kFisheye, Vec2(1.001e-4, 0), &beside);
  EXPECT_LT((beside - at_axis).norm(), 1e-7);
  EXPECT_EQ(*undistort(kFisheye, Vec2::Zero()), Vec2(Vec2::Zero()));
}

TEST(Distortion, FisheyeHasNoPinholeRayBeyondARightAngle) {
  EXPECT_FALSE(undistort(kFisheye, Vec2(1.6, 0)).has_value());
  const auto wide = undistort(kFisheye, distort(kFisheye, Vec2(7, 0)));  // 82° off the axis
  ASSERT_TRUE(wide.has_value());
  EXPECT_NEAR(wide->x(), 7, 1e-9);
}

TEST(Distortion, NoneIsTheIdentity) {
  EXPECT_TRUE(Distortion{}.none());
  EXPECT_FALSE(kWideAngle.none());
  EXPECT_EQ(distort({}, Vec2(0.4, 0.7)), Vec2(0.4, 0.7));
}

TEST(Distortion, JacobianAgreesWithFiniteDifferences) {
  Random random(1);
  for (const Distortion& d : {kDepthCamera, kWideAngle, kRational, kFisheye}) {
    for (int i = 0; i < 50; ++i) {
      const Vec2 point(random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.5));
      Eigen::Matrix2d jacobian;
      distort(d, point, &jacobian);
      for (int k = 0; k < 2; ++k) {
        constexpr double kStep = 1e-6;
        const Vec2 offset = kStep * Vec2::Unit(k);
        const Vec2 slope = (distort(d, point + offset) - distort(d, point - offset)) / (2 * kStep);
        EXPECT_LT((jacobian.col(k) - slope).norm(), 1e-8);
      }
    }
  }
}

TEST(Distortion, UndistortInvertsDistort) {
  Random random(2);
  for (const Distortion& d : {kDepthCamera, kWideAngle, kRational, kFisheye}) {
    for (int i = 0; i < 200; ++i) {
      const Vec2 point(random.uniform(-0.65, 0.65), random.uniform(-0.5, 0.5));
      const auto back = undistort(d, distort(d, point));
      ASSERT_TRUE(back.has_value()) << point.transpose();
      EXPECT_LT((*back - point).norm(), 1e-10);
    }
  }
}

TEST(Distortion, HasNoInverseBehindTheFold) {
  const Distortion barrel = {.k1 = -0.3};
  // The radius x (1 − 0.3 x²) never exceeds 0.7027.
  EXPECT_FALSE(undistort(barrel, Vec2(0.71, 0)).has_value());
  EXPECT_TRUE(undistort(barrel, Vec2(0.69, 0)).has_value());
}

}  // namespace
}  // namespace photoslam
