// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/relocalization.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "localization/testing/ideal_mapper.h"

namespace photoslam {
namespace {

using testing::IdealMapper;
using testing::PointWorld;
using testing::pose_error;
using testing::PoseError;

/// A mapped walk through a world whose corners look a little different each time.
class RelocalizerTest : public ::testing::Test {
 protected:
  RelocalizerTest() : world(1, 5000), mapper(world), relocalizer({}, FrameAlignment({}, {}, world.camera, world.bf)) {
    world.pixel_noise = 0.7;
    world.flipped_bits = 0.06;
    for (int i = 0; i < kKeyframes; ++i) {
      const SE3 pose = PointWorld::camera_from_world(kSecondsApart * i);
      const auto frame = world.observe(pose, i);
      mapper.add(KeyframeId(i), frame, pose, world.point_of_keypoint);
    }
    map = mapper.snapshot();
    relocalizer.update(*map);
  }

  static constexpr int kKeyframes = 40;
  static constexpr double kSecondsApart = 0.25;
  PointWorld world;
  IdealMapper mapper;
  Relocalizer relocalizer;
  std::shared_ptr<const MapSnapshot> map;
};

TEST_F(RelocalizerTest, FindsThePoseAfterRandomJumpsInsideTheMap) {
  Random random(3);
  int found = 0;
  for (int jump = 0; jump < 100; ++jump) {
    // Off the way by up to 15 cm and 6°.
    const Vec3 shift(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15));
    const Vec3 turn(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1));
    const SE3 truth =
        SE3(so3_exp(turn), shift) * PointWorld::camera_from_world(random.uniform(0, kSecondsApart * (kKeyframes - 1)));
    const auto result = relocalizer.relocalize(*map, *world.observe(truth, 1000 + jump), KeyframeId{});
    if (!result) continue;
    const PoseError error = pose_error(result->camera_from_world, truth);
    EXPECT_LT(error.position, 0.10) << "jump " << jump;
    EXPECT_LT(error.rotation, 5 * std::numbers::pi / 180) << "jump " << jump;
    EXPECT_TRUE(map->has(result->keyframe));
    ++found;
  }
  EXPECT_GE(found, 95);
}

TEST_F(RelocalizerTest, FindsNothingInAnotherPlaceMadeOfTheSameCorners) {
  // The same descriptors, elsewhere: only geometry can tell the places apart.
  PointWorld other(2, 5000);
  other.descriptors = world.descriptors;
  other.flipped_bits = world.flipped_bits;
  for (int i = 0; i < 100; ++i) {
    const SE3 pose = PointWorld::camera_from_world(0.1 * i);
    EXPECT_FALSE(relocalizer.relocalize(*map, *other.observe(pose, i), KeyframeId(i % kKeyframes))) << i;
  }
}

TEST_F(RelocalizerTest, ADoorThatLooksLikeAnotherOneIsNotItsPlace) {
  // What is around the door differs, and of the door alone there is enough to fix a pose.
  PointWorld other(2, 5000);
  other.flipped_bits = world.flipped_bits;
  for (size_t i = 0; i < world.points.size(); ++i) {
    const Vec3& p = world.points[i];
    if (p.z() < 3 || std::abs(p.x()) > 0.3) continue;
    other.points[i] = p;
    other.descriptors[i] = world.descriptors[i];
  }
  RelocalizationOptions by_number;
  by_number.evidence = {.min_matched_share = 0, .min_coverage = 0};
  Relocalizer trusting(by_number, FrameAlignment({}, {}, world.camera, world.bf));
  trusting.update(*map);
  int trusted = 0;
  for (int i = 0; i < 20; ++i) {
    const auto frame = other.observe(PointWorld::camera_from_world(0.02 * i), i);
    EXPECT_FALSE(relocalizer.relocalize(*map, *frame, KeyframeId(0))) << i;
    trusted += trusting.relocalize(*map, *frame, KeyframeId(0)).has_value();
  }
  EXPECT_GE(trusted, 15) << "else nothing is shown";
}

}  // namespace
}  // namespace photoslam
