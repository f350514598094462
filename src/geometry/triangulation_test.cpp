// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/triangulation.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera{640, 480, 500, 510, 330, 235};

PointView view_of(const SE3& camera_from_world, const Vec3& point) {
  return {camera_from_world, kCamera.project(camera_from_world * point), 1.0};
}

SE3 pose_b() { return {so3_exp(Vec3(0.05, -0.1, 0.2)), Vec3(-0.5, 0.1, 0.2)}; }

TEST(Triangulation, IsExactWithoutNoise) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Vec3 point(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(2, 8));
    const auto found = triangulate(kCamera, view_of(SE3(), point), view_of(pose_b(), point));
    ASSERT_TRUE(found);
    EXPECT_LT((*found - point).norm(), 1e-9);
  }
}

TEST(Triangulation, IsCloseToTheBestReprojection) {
  // With noise the reprojection error must be nearly that of the maximum-likelihood point (found by Gauss-Newton).
  Random random(2);
  double ours = 0, best = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3 truth(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(2, 8));
    PointView a = view_of(SE3(), truth), b = view_of(pose_b(), truth);
    for (PointView* view : {&a, &b}) view->pixel += Vec2(random.normal(), random.normal());
    const auto found = triangulate(kCamera, a, b, {.max_chi2 = 100});
    ASSERT_TRUE(found);
    const auto residuals = [&](const Vec3& x) {
      Eigen::Vector4d r;
      r << kCamera.project(a.camera_from_world * x) - a.pixel, kCamera.project(b.camera_from_world * x) - b.pixel;
      return r;
    };
    Vec3 x = truth;
    for (int iteration = 0; iteration < 20; ++iteration) {
      Eigen::Matrix<double, 4, 3> jacobian;
      for (int k = 0; k < 3; ++k) {
        const Vec3 step = 1e-6 * Vec3::Unit(k);
        jacobian.col(k) = (residuals(x + step) - residuals(x - step)) / 2e-6;
      }
      x -= (jacobian.transpose() * jacobian).inverse() * (jacobian.transpose() * residuals(x));
    }
    ours += residuals(*found).squaredNorm();
    best += residuals(x).squaredNorm();
  }
  EXPECT_GE(ours, best);
  EXPECT_LT(ours, 1.05 * best);
}

TEST(Triangulation, RefusesWhatCannotBeTrusted) {
  const Vec3 point(0.1, 0.2, 3);
  const PointView a = view_of(SE3(), point);
  // Too little parallax: 1 cm at 3 m.
  EXPECT_FALSE(triangulate(kCamera, a, view_of(SE3(Quat::Identity(), Vec3(0.01, 0, 0)), point)));
  // The same camera twice.
  EXPECT_FALSE(triangulate(kCamera, a, a));
  // Diverging rays, which meet behind the cameras.
  PointView b = view_of(pose_b(), point);
  const Vec3 behind(0.5, 0, -3);
  const PointView behind_a{SE3(), kCamera.project(behind), 1},
      behind_b{pose_b(), kCamera.project(pose_b() * behind), 1};
  EXPECT_FALSE(triangulate(kCamera, behind_a, behind_b));
  // Rays that pass each other at a distance.
  b.pixel.y() += 30;
  EXPECT_FALSE(triangulate(kCamera, a, b));
  b.sigma = 20;
  PointView coarse = a;
  coarse.sigma = 20;
  EXPECT_TRUE(triangulate(kCamera, coarse, b));
  b.pixel.x() = std::nan("");
  EXPECT_FALSE(triangulate(kCamera, a, b));
}

TEST(Parallax, IsTheAngleAtThePoint) {
  EXPECT_NEAR(parallax_angle({0, 0, 1}, {1, 0, 1}, {0, 1, 1}), std::acos(0.0), 1e-12);
  EXPECT_NEAR(parallax_angle({0, 0, 2}, {0, 0, 0}, {1e-9, 0, 0}), 5e-10, 1e-15);
}

}  // namespace
}  // namespace photoslam
