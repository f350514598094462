// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/run_settings.h"

namespace photoslam {

std::optional<SE3> camera_from_world(const FrameOutcome& frame, const FrozenMap& map) {
  if (!frame.has_pose || static_cast<size_t>(frame.reference.value) >= map.keyframes_from_world.size()) {
    return std::nullopt;
  }
  return frame.camera_from_reference * map.keyframes_from_world[static_cast<size_t>(frame.reference.value)];
}

Trajectory final_trajectory(const RunOutcome& run) {
  Trajectory trajectory;
  for (const FrameOutcome& frame : run.frames) {
    if (const auto pose = camera_from_world(frame, run.final)) {
      trajectory.push_back({frame.timestamp_ns, pose->inverse()});
    }
  }
  return trajectory;
}

Trajectory online_trajectory(const RunOutcome& run) {
  Trajectory trajectory;
  for (const FrameOutcome& frame : run.frames) {
    if (frame.has_pose) trajectory.push_back({frame.timestamp_ns, frame.online_camera_from_world.inverse()});
  }
  return trajectory;
}

Trajectory keyframe_trajectory(const RunOutcome& run) {
  Trajectory trajectory;
  for (const FrameOutcome& frame : run.frames) {
    if (!frame.keyframe.valid()) continue;
    if (const auto pose = camera_from_world(frame, run.final)) {
      trajectory.push_back({frame.timestamp_ns, pose->inverse()});
    }
  }
  return trajectory;
}

}  // namespace photoslam
