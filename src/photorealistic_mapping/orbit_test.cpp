// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/orbit.h"

#include <gtest/gtest.h>

#include <numbers>

#include "base/check.h"

namespace photoslam {
namespace {

/// Gaussians all over a cube of 8 m around the origin.
GaussianTable cube() {
  GaussianTable map;
  map.resize(1000);
  for (size_t i = 0; i < map.size(); ++i) {
    const size_t place[3] = {i % 10, i / 10 % 10, i / 100};
    for (size_t axis = 0; axis < 3; ++axis) map.row(i)[axis] = static_cast<float>(place[axis]) * 0.8f - 3.6f;
  }
  return map;
}

/// On a horizontal circle of this radius (y points down), looking to the middle or away from it.
Trajectory circle(double radius, bool inwards) {
  Trajectory walk;
  for (int i = 0; i < 36; ++i) {
    const double angle = i * std::numbers::pi / 18;
    const Vec3 outwards(std::sin(angle), 0, std::cos(angle));
    const double turn = inwards ? angle + std::numbers::pi : angle;
    walk.push_back({i, SE3(so3_exp(Vec3(0, turn, 0)), radius * outwards)});
  }
  return walk;
}

void expect_upright(const SE3& camera_from_world) {
  EXPECT_TRUE(camera_from_world.matrix().allFinite());
  const Vec3 right = camera_from_world.inverse().rotation * Vec3::UnitX();
  EXPECT_NEAR(right.y(), 0, 1e-9);
}

TEST(Orbit, GoesAroundWhatAllLookAt) {
  for (const SE3& pose : orbit(cube(), circle(2, true), 16)) {
    expect_upright(pose);
    EXPECT_NEAR(pose.inverse().translation.norm(), 2, 1e-6);
    EXPECT_LT((pose * Vec3(0, 0, 0) - Vec3(0, 0, 2)).norm(), 1e-6);
  }
}

TEST(Orbit, FollowsAWalkThatLooksAround) {
  const Trajectory walk = circle(2, false);
  const std::vector<SE3> poses = orbit(cube(), walk, 36);
  for (size_t i = 0; i < poses.size(); ++i) {
    const SE3 near = walk[i].world_from_camera;
    EXPECT_TRUE(poses[i].matrix().allFinite());
    EXPECT_LT((poses[i].inverse().translation - near.translation).norm(), 0.6);
    EXPECT_GT((poses[i] * (near * Vec3(0, 0, 10))).normalized().z(), 0.95);
  }
}

TEST(Orbit, HasAViewOfAMapWithoutCamerasAndWithOne) {
  for (const SE3& pose : orbit(cube(), {}, 8)) {
    expect_upright(pose);
    const Vec3 middle = pose * Vec3(0, 0, 0);
    EXPECT_GT(middle.z(), 1);
    EXPECT_LT(middle.norm() - middle.z(), 0.1) << "within half a step of the grid";
  }
  for (const SE3& pose : orbit(cube(), {{0, SE3()}}, 8)) {
    expect_upright(pose);
    EXPECT_GT((pose * Vec3(0, 0, 1)).normalized().z(), 0.99) << "where it looked";
    EXPECT_LT(pose.inverse().translation.norm(), 0.2);
  }
  EXPECT_THROW(orbit({}, {}, 8), CheckError);
}

}  // namespace
}  // namespace photoslam
