// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/run_settings.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

FrameOutcome frame(int64_t time, int reference) {
  FrameOutcome outcome;
  outcome.timestamp_ns = time;
  outcome.has_pose = reference >= 0;
  outcome.reference = KeyframeId(reference);
  outcome.keyframe = KeyframeId(reference);
  return outcome;
}

TEST(ConnectedFrames, TrajectoriesLeaveOutMapsThatAreNotConnectedWithTheLargest) {
  RunOutcome run;
  run.frames = {frame(0, 0), frame(1, -1), frame(2, 1), frame(3, 1), frame(4, 2), frame(5, 0)};
  run.final.keyframes_from_world.resize(3);
  run.final.keyframe_scales.assign(3, 1.0);
  const auto times = [](const Trajectory& trajectory) {
    std::vector<int64_t> result;
    for (const StampedPose& pose : trajectory) result.push_back(pose.timestamp_ns);
    return result;
  };
  EXPECT_EQ(times(final_trajectory(run)), (std::vector<int64_t>{0, 2, 3, 4, 5})) << "one map, one lost frame";
  EXPECT_EQ(connected_keyframes(run), (std::vector<uint8_t>{1, 1, 1}));
  run.component_of_keyframe = {0, 1, 1};
  EXPECT_EQ(times(final_trajectory(run)), (std::vector<int64_t>{2, 3, 4}));
  EXPECT_EQ(times(online_trajectory(run)), (std::vector<int64_t>{2, 3, 4}));
  EXPECT_EQ(times(keyframe_trajectory(run)), (std::vector<int64_t>{2, 3, 4}));
  EXPECT_EQ(connected_keyframes(run), (std::vector<uint8_t>{0, 1, 1}));
  EXPECT_TRUE(final_trajectory({}).empty());
}

}  // namespace
}  // namespace photoslam
