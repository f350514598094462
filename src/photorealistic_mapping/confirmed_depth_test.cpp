// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/confirmed_depth.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

constexpr double kWall = 2.0;

/// The wall z = 2 m as a camera to the right of the origin by `x` sees it, turned about the vertical by `angle`.
DepthPicture wall_from(double angle, double x, SE3& camera_from_world) {
  const SE3 world_from_camera(so3_exp(Vec3(0, angle, 0)), Vec3(x, 0, 0));
  camera_from_world = world_from_camera.inverse();
  DepthPicture picture;
  picture.camera = {64, 48, 60, 60, 31.5, 23.5};
  picture.depth = ImageF(64, 48);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const Vec3 ray = world_from_camera.rotation * picture.camera.unproject(Vec2(u, v), 1.0);
      picture.depth(u, v) = static_cast<float>(kWall / ray.z());
    }
  }
  return picture;
}

class ConfirmedDepth : public ::testing::Test {
 protected:
  ConfirmedDepth() : view(wall_from(0, 0, view_from_world)), other(wall_from(0.2, -0.3, other_from_world)) {}
  ImageF confirmed(double tolerance = 0.05) const {
    const MeasuredView others[] = {{&other, other_from_world * view_from_world.inverse()}};
    return confirmed_depth(view, others, tolerance);
  }
  SE3 view_from_world, other_from_world;
  DepthPicture view, other;
};

TEST_F(ConfirmedDepth, IsWhatTheOtherSawToo) {
  // The pixel's point on the wall lies in the other picture, or it does not.
  int agreed = 0;
  const ImageF result = confirmed();
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const Vec3 point = view.camera.unproject(Vec2(u, v), kWall);
      const bool seen = other.camera.contains(other.camera.project(Vec3(other_from_world * point)));
      EXPECT_EQ(result(u, v), seen ? view.depth(u, v) : 0.0f) << u << " " << v;
      agreed += seen;
    }
  }
  EXPECT_GT(agreed, 1000);
  EXPECT_LT(agreed, 64 * 48 - 100);
}

TEST_F(ConfirmedDepth, IsNotWhatTheOtherSawElsewhere) {
  view.depth(40, 20) = static_cast<float>(0.9 * kWall);
  view.depth(41, 20) = static_cast<float>(1.02 * kWall);
  view.depth(42, 20) = 0;
  const ImageF result = confirmed();
  EXPECT_EQ(result(40, 20), 0);
  EXPECT_EQ(result(41, 20), view.depth(41, 20));
  EXPECT_EQ(result(42, 20), 0);
  EXPECT_EQ(confirmed(0.01)(41, 20), 0);
}

TEST_F(ConfirmedDepth, NeedsAMeasurementThere) {
  for (float& depth : other.depth.values()) depth = 0;
  for (const float depth : confirmed().values()) EXPECT_EQ(depth, 0);
  for (const float depth : confirmed_depth(view, {}, 0.05).values()) EXPECT_EQ(depth, 0);
}

}  // namespace
}  // namespace photoslam
