// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/tracker.h"

#include <gtest/gtest.h>

#include "localization/testing/ideal_mapper.h"

namespace photoslam {
namespace {

using testing::IdealMapper;
using testing::PointWorld;
using testing::pose_error;
using testing::PoseError;

class TrackerTest : public ::testing::Test {
 protected:
  TrackerTest() : tracker({}, {}, world.camera, world.bf), mapper(world) {}

  TrackingResult step(int frame, const SE3& truth, bool map_it = true) {
    const auto observed = world.observe(truth, frame);
    TrackingResult result = tracker.track(observed, snapshot, map_it);
    if (result.keyframe) {
      mapper.add(result.keyframe->id, result.keyframe->frame, truth, world.point_of_keypoint);
      snapshot = mapper.snapshot();
    }
    return result;
  }

  /// Maps 75 frames; returns the last.
  std::shared_ptr<const FeatureFrame> walk() {
    for (int frame = 0; frame < 75; ++frame) step(frame, PointWorld::camera_from_world(frame / 30.0));
    return world.observe(PointWorld::camera_from_world(74 / 30.0), 74);
  }

  PointWorld world;
  Tracker tracker;
  IdealMapper mapper;
  std::shared_ptr<const MapSnapshot> snapshot;
};

TEST_F(TrackerTest, ExactWorldGivesExactPoses) {
  for (int frame = 0; frame < 120; ++frame) {
    const SE3 truth = PointWorld::camera_from_world(frame / 30.0);
    const TrackingResult result = step(frame, truth);
    ASSERT_TRUE(result.has_pose) << "frame " << frame << ": " << result.reason;
    const PoseError error = pose_error(result.camera_from_world, truth);
    EXPECT_LT(error.position, 1e-4) << "frame " << frame;
    EXPECT_LT(error.rotation, 2e-5) << "frame " << frame;
  }
}

TEST_F(TrackerTest, ToleratesNoiseAndWrongMatches) {
  world.pixel_noise = 0.7;
  world.wrong_share = 0.2;
  double sum = 0;
  for (int frame = 0; frame < 90; ++frame) {
    const SE3 truth = PointWorld::camera_from_world(frame / 30.0);
    const TrackingResult result = step(frame, truth);
    ASSERT_TRUE(result.has_pose) << "frame " << frame << ": " << result.reason;
    sum += std::pow(pose_error(result.camera_from_world, truth).position, 2);
  }
  // Several hundred points at 3 m and about 1 px fix the position to a few millimetres.
  EXPECT_LT(std::sqrt(sum / 90), 0.006);
}

TEST_F(TrackerTest, LosesWithAReasonAndFindsTheMapAgain) {
  for (int frame = 0; frame < 30; ++frame) step(frame, PointWorld::camera_from_world(frame / 30.0));
  const SE3 backwards(so3_exp(Vec3(0, 3.1, 0)), Vec3::Zero());
  for (int frame = 30; frame < 36; ++frame) {
    const TrackingResult result = step(frame, backwards);
    EXPECT_FALSE(result.has_pose);
    EXPECT_EQ(result.state, TrackingState::recently_lost);
    EXPECT_FALSE(result.reason.empty());
    EXPECT_FALSE(result.keyframe.has_value());
  }
  const TrackingResult late = step(150, backwards, false);
  EXPECT_EQ(late.state, TrackingState::lost) << "after two seconds";
  const SE3 truth = PointWorld::camera_from_world(0.5);
  const TrackingResult found = step(151, truth);
  ASSERT_TRUE(found.has_pose) << found.reason;
  EXPECT_LT(pose_error(found.camera_from_world, truth).position, 1e-3);
}

/// What a camera sees that was carried elsewhere, and 40 things of its last view that came along.
std::shared_ptr<const FeatureFrame> carried(PointWorld& to, const SE3& pose, int id, const FeatureFrame& last) {
  auto frame = std::make_shared<FeatureFrame>(*to.observe(pose, id));
  for (size_t i = 0; i < 40; ++i) {
    const size_t along = i * last.size() / 40;
    frame->features.keypoints.push_back(last.features.keypoints[along]);
    frame->features.descriptors.push_back(last.features.descriptors[along]);
    frame->depth.push_back(last.depth[along]);
    frame->observations.push_back(last.observations[along]);
  }
  frame->grid.build(frame->features.keypoints, to.camera.width, to.camera.height);
  return frame;
}

TEST_F(TrackerTest, APoseWhereLittleOfTheMapIsFoundIsNone) {
  const auto last = walk();
  PointWorld unknown(77);
  const TrackingResult away = tracker.track(carried(unknown, SE3{}, 75, *last), snapshot, true);
  EXPECT_FALSE(away.has_pose) << away.num_inliers << " inliers where the camera was";

  const SE3 truth = PointWorld::camera_from_world(0);
  const TrackingResult back = tracker.track(carried(world, truth, 76, *last), snapshot, true);
  ASSERT_TRUE(back.has_pose) << back.reason;
  EXPECT_LT(pose_error(back.camera_from_world, truth).position, 1e-3);
  EXPECT_GT(back.num_inliers, 200);
}

TEST_F(TrackerTest, ACameraCarriedBackIsNoticed) {
  const auto last = walk();
  const SE3 truth = PointWorld::camera_from_world(0);
  const TrackingResult result = tracker.track(carried(world, truth, 75, *last), snapshot, false);
  ASSERT_TRUE(result.has_pose) << result.reason;
  EXPECT_LT(pose_error(result.camera_from_world, truth).position, 1e-3);
}

TEST_F(TrackerTest, LostForLongItBeginsAnotherMapAndFindsTheOldOneAgain) {
  for (int frame = 0; frame < 30; ++frame) step(frame, PointWorld::camera_from_world(frame / 30.0));
  const auto num_keyframes = snapshot->keyframes.size();
  PointWorld elsewhere(77);
  const TrackingResult away = tracker.track(elsewhere.observe(SE3{}, 40), snapshot, true);
  EXPECT_FALSE(away.has_pose);
  const TrackingResult begun = tracker.track(elsewhere.observe(SE3{}, 120), snapshot, true);
  ASSERT_TRUE(begun.has_pose) << begun.reason;
  ASSERT_TRUE(begun.keyframe.has_value());
  EXPECT_FALSE(begun.keyframe->reference.valid());
  EXPECT_EQ(begun.keyframe->id, KeyframeId(static_cast<int32_t>(num_keyframes)));
  EXPECT_GT(begun.camera_from_world.inverse().translation.norm(), 1000) << "worlds that are not connected lie apart";

  const SE3 truth = PointWorld::camera_from_world(0.5);
  const TrackingResult found = tracker.track(world.observe(truth, 121), snapshot, false);
  ASSERT_TRUE(found.has_pose) << found.reason;
  EXPECT_LT(pose_error(found.camera_from_world, truth).position, 1e-3);
  EXPECT_LT(found.reference, KeyframeId(static_cast<int32_t>(num_keyframes)));
}

TEST_F(TrackerTest, PosesFollowACorrectionOfTheirReferenceKeyframe) {
  const SE3 first = PointWorld::camera_from_world(0);
  TrackingResult result = step(0, first);
  ASSERT_TRUE(result.keyframe.has_value());
  result = step(1, PointWorld::camera_from_world(1 / 30.0));
  ASSERT_TRUE(result.has_pose);
  EXPECT_EQ(result.reference, KeyframeId(0));
  EXPECT_LT(pose_error(result.camera_from_reference * first, result.camera_from_world).position, 1e-9);

  const SE3 moved(so3_exp(Vec3(0.1, -0.4, 0.05)), Vec3(2, 0.3, -1));
  MapCorrection correction;
  correction.new_world_from_old_world.assign(snapshot->keyframes.size(), Sim3(moved));
  mapper.apply(correction);
  snapshot = mapper.snapshot();
  for (int frame = 2; frame < 5; ++frame) {
    const SE3 truth = PointWorld::camera_from_world(frame / 30.0);
    result = tracker.track(world.observe(truth, frame), snapshot, true);
    ASSERT_TRUE(result.has_pose) << result.reason;
    EXPECT_LT(pose_error(result.camera_from_world, truth * moved.inverse()).position, 1e-3);
  }
}

TEST_F(TrackerTest, AKeyframeMayBeCulledBeforeItsPointsAreKnown) {
  const auto track = [&](int frame) {
    const auto observed = world.observe(PointWorld::camera_from_world(frame / 30.0), frame);
    return tracker.track(observed, snapshot, true);
  };
  ASSERT_TRUE(step(0, PointWorld::camera_from_world(0)).keyframe.has_value());
  // The next keyframe and what it adds reach tracking late.
  int frame = 1;
  TrackingResult result;
  while (!result.keyframe) {
    ASSERT_LT(frame, 90);
    result = track(frame++);
    ASSERT_TRUE(result.has_pose) << result.reason;
  }
  const SE3 pose = PointWorld::camera_from_world((frame - 1) / 30.0);
  mapper.add(result.keyframe->id, result.keyframe->frame, pose, world.point_of_keypoint);
  const TrackingResult before = track(frame++);  // matches points of the pending keyframe
  ASSERT_TRUE(before.has_pose) << before.reason;
  mapper.cull(KeyframeId(1), KeyframeId(0));
  snapshot = mapper.snapshot();
  const SE3 truth = PointWorld::camera_from_world(frame / 30.0);
  const TrackingResult after = track(frame);
  ASSERT_TRUE(after.has_pose) << after.reason;
  EXPECT_LT(pose_error(after.camera_from_world, truth).position, 1e-4);
}

/// A single camera: a loop changes the scale of the map while a keyframe, and what was tracked by it, is on its way.
TEST_F(TrackerTest, WhatIsPendingGrowsWithAMapThatIsCorrected) {
  static constexpr double kGrowth = 1.7;
  world.with_depth = false;
  Tracker single({}, {}, world.camera, 0);
  const auto truth = [](int frame) { return PointWorld::camera_from_world(frame / 30.0); };
  for (const int frame : {0, 15}) {
    const auto observed = world.observe(truth(frame), frame);
    mapper.add(KeyframeId(frame / 15), observed, truth(frame), world.point_of_keypoint);
  }
  snapshot = mapper.snapshot();
  single.resume(2, 1);
  int frame = 15;
  const auto track = [&](bool map_it) { return single.track(world.observe(truth(frame), frame), snapshot, map_it); };
  TrackingResult result;
  for (; !result.keyframe; ++frame) {
    ASSERT_LT(frame, 90);
    result = track(frame > 20);
    ASSERT_TRUE(result.has_pose) << frame << ": " << result.reason;
  }
  const KeyframeProposal first = *result.keyframe;
  const SE3 first_pose = truth(frame - 1);
  for (int i = 0; i < 5; ++i, ++frame) ASSERT_TRUE(track(false).has_pose);

  const Sim3 grow(kGrowth, Quat::Identity(), Vec3::Zero());
  mapper.apply({.new_world_from_old_world = {grow, grow}});
  snapshot = mapper.snapshot();
  const auto grown = [](const SE3& pose) { return SE3(pose.rotation, kGrowth * pose.translation); };
  result = {};
  for (int i = 0; !result.keyframe; ++i, ++frame) {
    ASSERT_LT(frame, 150);
    result = track(i > 5);
    ASSERT_TRUE(result.has_pose) << frame << ": " << result.reason;
    EXPECT_LT(pose_error(result.camera_from_world, grown(truth(frame))).position, 1e-3) << frame;
    if (result.keyframe) break;
    EXPECT_EQ(result.reference, first.id) << "nothing was lost";
    EXPECT_DOUBLE_EQ(result.reference_scale, kGrowth);
    const SE3 final_pose = result.camera_from_reference * grown(first_pose);
    EXPECT_LT(pose_error(final_pose, grown(truth(frame))).position, 1e-3) << frame;
  }
  EXPECT_EQ(first.reference_scale, 1.0);
  EXPECT_DOUBLE_EQ(result.keyframe->reference_scale, kGrowth) << "so that it is not scaled twice";
  const SE3 second_pose = result.keyframe->camera_from_reference * grown(first_pose);
  EXPECT_LT(pose_error(second_pose, grown(truth(frame))).position, 1e-3);
  EXPECT_DOUBLE_EQ(result.reference_scale, 1.0) << "it is born in the unit of today";
}

TEST_F(TrackerTest, HeldOutFramesNeverBecomeKeyframes) {
  step(0, PointWorld::camera_from_world(0));
  for (int frame = 1; frame < 60; ++frame) {
    const TrackingResult result = step(frame, PointWorld::camera_from_world(frame / 30.0), false);
    ASSERT_TRUE(result.has_pose) << "frame " << frame;
    EXPECT_FALSE(result.keyframe.has_value());
  }
}

TEST(Tracker, WaitsForAFrameWithEnoughDepth) {
  PointWorld world(1, 300);
  Tracker tracker({}, {}, world.camera, world.bf);
  const TrackingResult result = tracker.track(world.observe(SE3{}, 0), nullptr, true);
  EXPECT_FALSE(result.has_pose);
  EXPECT_EQ(result.state, TrackingState::initializing);
  EXPECT_NE(result.reason.find("needed"), std::string::npos) << result.reason;
}

}  // namespace
}  // namespace photoslam
