// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/mono_initializer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "map/testing/point_world.h"

namespace photoslam {
namespace {

using testing::PointWorld;

class MonoInitializerTest : public ::testing::Test {
 protected:
  MonoInitializerTest() : initializer({}, world.camera) { world.with_depth = false; }

  std::optional<InitialPair> add(const SE3& camera_from_world, int id) {
    // The corner of the room is in view: of a single wall, two motions would be possible.
    auto frame = world.observe(camera_from_world * SE3(so3_exp(Vec3(0, 0.8, 0)), Vec3::Zero()), id);
    points_of_frame.push_back(world.point_of_keypoint);
    return initializer.add(frame, reason);
  }

  PointWorld world;
  MonoInitializer initializer;
  std::string reason;
  std::vector<std::vector<int>> points_of_frame;
};

TEST_F(MonoInitializerTest, GivesMotionAndStructureInUnitsOfTheMedianDepth) {
  ASSERT_FALSE(add(SE3{}, 0));
  EXPECT_EQ(initializer.first_view(), FrameId(0));
  const SE3 truth(so3_exp(Vec3(0.01, 0.03, 0)), Vec3(-0.25, 0.02, 0.03));
  const auto pair = add(truth, 1);
  ASSERT_TRUE(pair) << reason;
  EXPECT_GT(pair->points.size(), 100u);
  std::vector<double> depths;
  const double unit = truth.translation.norm() / pair->second_from_first.translation.norm();
  for (const auto& [first, second, in_first] : pair->points) {
    const int point = points_of_frame[0][static_cast<size_t>(first)];
    EXPECT_EQ(point, points_of_frame[1][static_cast<size_t>(second)]);
    const Vec3 truth_in_first = so3_exp(Vec3(0, 0.8, 0)) * world.points[static_cast<size_t>(point)];
    EXPECT_LT((unit * in_first - truth_in_first).norm(), 1e-3);
    depths.push_back(in_first.z());
  }
  std::ranges::sort(depths);
  EXPECT_NEAR(depths[(depths.size() - 1) / 2], 1.0, 1e-9);
  EXPECT_LT(so3_log(pair->second_from_first.rotation * truth.rotation.inverse()).norm(), 1e-5);
}

TEST_F(MonoInitializerTest, WaitsWhileTheCameraOnlyTurns) {
  world.pixel_noise = 0.5;
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(add(SE3(so3_exp(Vec3(0, 0.01 * i, 0)), Vec3::Zero()), i));
  EXPECT_EQ(initializer.first_view(), FrameId(0)) << reason;
}

/// Moves from one place to another; gives the angle between the translation found and the true one [rad].
std::optional<double> direction_error(PointWorld& world, const SE3& first_from_world, const SE3& second_from_first,
                                      std::string& reason) {
  MonoInitializer initializer({}, world.camera);
  EXPECT_FALSE(initializer.add(world.observe(first_from_world, 0), reason));
  const auto pair = initializer.add(world.observe(second_from_first * first_from_world, 1), reason);
  if (!pair) return std::nullopt;
  return std::acos(pair->second_from_first.translation.normalized().dot(second_from_first.translation.normalized()));
}

TEST_F(MonoInitializerTest, AWallAllowsTwoMotionsOfWhichTheWrongOneIsNeverTaken) {
  world.pixel_noise = 0.7;
  const Quat to_the_right = so3_exp(Vec3(0, -std::numbers::pi / 2, 0));
  const SE3 wall_only(to_the_right, to_the_right * Vec3(-1, 0, 0));
  const SE3 wall_and_more(so3_exp(Vec3(0, -0.8, 0)), Vec3::Zero());
  std::set<std::string> reasons;
  int accepted = 0;
  for (const SE3& first : {wall_only, wall_and_more}) {
    for (double step = 0.04; step <= 0.3; step += 0.02) {
      const SE3 motion(so3_exp(Vec3(0.01, 0.03, 0)), step * Vec3(-1, 0.08, 0.12));
      if (const auto error = direction_error(world, first, motion, reason)) {
        ++accepted;
        // The wrong motion goes along the normal of the wall.
        EXPECT_LT(*error, std::numbers::pi / 4) << "after " << step << " m";
      } else {
        reasons.insert(reason);
      }
    }
  }
  EXPECT_GT(accepted, 8);
  EXPECT_TRUE(reasons.contains("two motions are possible"));
}

TEST_F(MonoInitializerTest, TakesAnotherFirstViewWhenItLosesSightOfIt) {
  EXPECT_FALSE(add(SE3{}, 0));
  EXPECT_FALSE(add(SE3(so3_exp(Vec3(0, 2.5, 0)), Vec3::Zero()), 1));
  EXPECT_EQ(initializer.first_view(), FrameId(1));
  EXPECT_NE(reason.find("matches"), std::string::npos) << reason;
}

}  // namespace
}  // namespace photoslam
