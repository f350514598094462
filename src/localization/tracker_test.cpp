// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/tracker.h"

#include <gtest/gtest.h>

#include "map/map.h"
#include "map/testing/point_world.h"

namespace photoslam {
namespace {

using testing::PointWorld;

/// Puts every proposal into a map with exact poses and points, as an ideal mapper would.
class IdealMapper {
 public:
  explicit IdealMapper(const PointWorld& world)
      : world_(world), map_(1.2, 8), landmark_of_point_(world.points.size()) {}

  void add(const KeyframeProposal& proposal, const SE3& true_pose, const std::vector<int>& point_of_keypoint) {
    map_.add_keyframe(proposal.id, proposal.frame, true_pose);
    for (size_t i = 0; i < point_of_keypoint.size(); ++i) {
      const auto point = static_cast<size_t>(point_of_keypoint[i]);
      LandmarkId& landmark = landmark_of_point_[point];
      if (landmark.valid()) {
        map_.add_observation(landmark, proposal.id, static_cast<int>(i));
        map_.update_view(landmark);
      } else {
        landmark = map_.add_landmark(world_.points[point], proposal.id, static_cast<int>(i));
      }
    }
  }
  std::shared_ptr<const MapSnapshot> snapshot() { return map_.snapshot(); }

 private:
  const PointWorld& world_;
  Map map_;
  std::vector<LandmarkId> landmark_of_point_;
};

struct Error {
  double position = 0, rotation = 0;
};

Error pose_error(const SE3& estimate, const SE3& truth) {
  const SE3 difference = estimate * truth.inverse();
  return {difference.translation.norm(), so3_log(difference.rotation).norm()};
}

class TrackerTest : public ::testing::Test {
 protected:
  TrackerTest() : tracker({}, {}, world.camera, world.bf), mapper(world) {}

  TrackingResult step(int frame, const SE3& truth, bool map_it = true) {
    const auto observed = world.observe(truth, frame);
    TrackingResult result = tracker.track(observed, snapshot, map_it);
    if (result.keyframe) {
      mapper.add(*result.keyframe, truth, world.point_of_keypoint);
      snapshot = mapper.snapshot();
    }
    return result;
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
    const Error error = pose_error(result.camera_from_world, truth);
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
  const TrackingResult late = step(150, backwards);
  EXPECT_EQ(late.state, TrackingState::lost) << "after two seconds";
  const SE3 truth = PointWorld::camera_from_world(0.5);
  const TrackingResult found = step(151, truth);
  ASSERT_TRUE(found.has_pose) << found.reason;
  EXPECT_LT(pose_error(found.camera_from_world, truth).position, 1e-3);
}

TEST_F(TrackerTest, PosesFollowACorrectionOfTheirReferenceKeyframe) {
  const SE3 first = PointWorld::camera_from_world(0);
  TrackingResult result = step(0, first);
  ASSERT_TRUE(result.keyframe.has_value());
  result = step(1, PointWorld::camera_from_world(1 / 30.0));
  ASSERT_TRUE(result.has_pose);
  EXPECT_EQ(result.reference, KeyframeId(0));
  const SE3 final_pose = result.camera_from_reference * first;
  EXPECT_LT(pose_error(final_pose, result.camera_from_world).position, 1e-9);
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
