// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/posed_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {100, 80, 90, 90, 49.5, 39.5};

/// A camera at `position` looking at `target`, with y down.
SE3 look_at(const Vec3& position, const Vec3& target) {
  const Vec3 forward = (target - position).normalized();
  const Vec3 right = Vec3::UnitY().cross(forward).normalized();
  Mat3 world_from_camera;
  world_from_camera << right, forward.cross(right), forward;
  return SE3(Quat(world_from_camera), position).inverse();
}

TEST(PosedMap, CamerasSeeThePointsInTheirImages) {
  const std::vector<SE3> poses = {SE3{}, look_at({5, 0, 0}, {5, 0, 4}), look_at({0.2, 0, 0}, {0.2, 0, 4})};
  const std::vector<Vec3> points = {{0, 0, 4}, {5, 0, 4}, {0, 0, -4}, {0.3, 0.2, 2}};
  const auto map = posed_map(kCamera, poses, points);
  ASSERT_EQ(map->keyframes.size(), 3u);
  const Keyframe& first = map->keyframe(KeyframeId(0)).keyframe;
  EXPECT_EQ(first.landmarks, (std::vector<LandmarkId>{LandmarkId(0), LandmarkId(3)})) << "neither aside nor behind";
  EXPECT_EQ(first.frame->size(), 2u);
  EXPECT_EQ(first.frame->features.keypoints[0].x, 49.5f);
  EXPECT_EQ(map->keyframe(KeyframeId(0)).median_depth, 2.0);
  EXPECT_EQ(map->keyframe(KeyframeId(0)).covisible.front().keyframe, KeyframeId(2));
  EXPECT_EQ(map->keyframe(KeyframeId(0)).covisible.front().shared_landmarks, 2);
}

TEST(PosedMap, WithoutPointsNearCamerasAreCovisible) {
  std::vector<SE3> poses;
  for (const double x : {0.0, 3.0, 0.5, -6.0}) poses.push_back(look_at({x, 0, -5}, {0, 0.1, 0}));
  const auto map = posed_map(kCamera, poses, {});
  EXPECT_EQ(map->keyframe(KeyframeId(0)).covisible.front().keyframe, KeyframeId(2));
  EXPECT_NEAR(map->keyframe(KeyframeId(0)).median_depth, 5.0, 0.1);
}

TEST(PosedMap, CamerasThatLookOutwardsSeeSomethingSomeWayOff) {
  std::vector<SE3> poses;
  for (const double angle : {0.0, 2.1, 4.2}) {
    const Vec3 center(std::sin(angle), 0, std::cos(angle));
    poses.push_back(look_at(center, 2 * center));
  }
  const auto map = posed_map(kCamera, poses, {});
  for (const auto& view : map->keyframes) EXPECT_GT(view->median_depth, 0.09) << "a tenth of the walk";
}

TEST(FocusPoint, IsWhereTheAxesMeet) {
  const Vec3 target(0.3, -0.2, 1.5);
  std::vector<SE3> poses;
  for (const double x : {-4.0, 0.5, 3.0}) poses.push_back(look_at({x, x * 0.3, -5}, target));
  EXPECT_LT((focus_point(poses) - target).norm(), 1e-9);
}

TEST(FocusPoint, OfParallelCamerasIsJustAhead) {
  const std::vector<SE3> poses = {SE3{}, SE3(Quat::Identity(), Vec3(1, 0, 0))};
  EXPECT_EQ(focus_point(poses), Vec3(0, 0, 1));
}

}  // namespace
}  // namespace photoslam
