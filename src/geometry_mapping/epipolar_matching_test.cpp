// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry_mapping/epipolar_matching.h"

#include <gtest/gtest.h>

#include <set>

#include "map/testing/point_world.h"

namespace photoslam {
namespace {

using testing::PointWorld;

TEST(EpipolarMatching, FindsTheSamePointsInBothViews) {
  PointWorld world;
  world.pixel_noise = 0.5;
  const SE3 b_from_a(so3_exp(Vec3(0.02, -0.1, 0.3)), Vec3(-0.4, 0.05, 0.1));
  const auto a = world.observe(SE3{}, 0);
  const auto points_a = world.point_of_keypoint;
  const auto b = world.observe(b_from_a, 1);
  const auto points_b = world.point_of_keypoint;
  // Orientations turn with the camera.
  auto turned = std::make_shared<FeatureFrame>(*b);
  for (Keypoint& k : turned->features.keypoints) k.angle = 0.3f;

  std::vector<uint8_t> usable_a(a->size(), 1), usable_b(b->size(), 1);
  usable_a[5] = 0;
  const auto pairs = match_along_epipolar_lines(world.camera, {*a, usable_a}, {*turned, usable_b}, b_from_a);
  std::set<int> common(points_a.begin(), points_a.end()), in_both;
  for (const int point : points_b) {
    if (common.contains(point)) in_both.insert(point);
  }
  // A 95 % bound on the distance from the line is meant to lose one in twenty of the noisy points; its own noise moves
  // the line as well.
  EXPECT_GT(static_cast<double>(pairs.size()), 0.8 * static_cast<double>(in_both.size()));
  std::set<int> seen;
  for (const auto& [i, j] : pairs) {
    EXPECT_EQ(points_a[static_cast<size_t>(i)], points_b[static_cast<size_t>(j)]);
    EXPECT_NE(i, 5);
    EXPECT_TRUE(seen.insert(i).second);
  }
}

TEST(EpipolarMatching, IgnoresLookalikesOffTheLine) {
  PointWorld world;
  const SE3 b_from_a(Quat::Identity(), Vec3(-0.4, 0, 0));
  const auto a = world.observe(SE3{}, 0);
  auto b = std::make_shared<FeatureFrame>(*world.observe(b_from_a, 1));
  for (PixelObservation& o : b->observations) o.pixel.y() += 60;  // epipolar lines are rows
  const std::vector<uint8_t> usable_a(a->size(), 1), usable_b(b->size(), 1);
  EXPECT_TRUE(match_along_epipolar_lines(world.camera, {*a, usable_a}, {*b, usable_b}, b_from_a).empty());
}

}  // namespace
}  // namespace photoslam
