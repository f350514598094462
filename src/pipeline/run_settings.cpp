// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/run_settings.h"

#include <algorithm>
#include <map>

namespace photoslam {
namespace {

int component_of(const FrameOutcome& frame, const RunOutcome& run) {
  const auto reference = static_cast<size_t>(frame.reference.value);
  return frame.reference.valid() && reference < run.component_of_keyframe.size() ? run.component_of_keyframe[reference]
                                                                                 : 0;
}

/// That of most tracked frames.
int largest_component(const RunOutcome& run) {
  std::map<int, int> sizes = {{0, 0}};
  for (const FrameOutcome& frame : run.frames) sizes[component_of(frame, run)] += frame.has_pose ? 1 : 0;
  return std::ranges::max_element(sizes, {}, [](const auto& entry) { return entry.second; })->first;
}

}  // namespace

std::optional<SE3> camera_from_world(const FrameOutcome& frame, const FrozenMap& map) {
  if (!frame.has_pose || static_cast<size_t>(frame.reference.value) >= map.keyframes_from_world.size()) {
    return std::nullopt;
  }
  const auto reference = static_cast<size_t>(frame.reference.value);
  SE3 camera_from_reference = frame.camera_from_reference;
  camera_from_reference.translation *= map.keyframe_scales[reference] / frame.reference_scale;
  return camera_from_reference * map.keyframes_from_world[reference];
}

std::vector<FrameOutcome> connected_frames(const RunOutcome& run) {
  const int largest = largest_component(run);
  std::vector<FrameOutcome> frames;
  for (const FrameOutcome& frame : run.frames) {
    if (frame.has_pose && component_of(frame, run) == largest) frames.push_back(frame);
  }
  return frames;
}

std::vector<uint8_t> connected_keyframes(const RunOutcome& run) {
  const int largest = largest_component(run);
  std::vector<uint8_t> connected(run.final.keyframes_from_world.size(), 1);
  for (size_t i = 0; i < std::min(connected.size(), run.component_of_keyframe.size()); ++i) {
    connected[i] = run.component_of_keyframe[i] == largest ? 1 : 0;
  }
  return connected;
}

Trajectory final_trajectory(const RunOutcome& run) {
  Trajectory trajectory;
  for (const FrameOutcome& frame : connected_frames(run)) {
    if (const auto pose = camera_from_world(frame, run.final)) {
      trajectory.push_back({frame.timestamp_ns, pose->inverse()});
    }
  }
  return trajectory;
}

Trajectory online_trajectory(const RunOutcome& run) {
  Trajectory trajectory;
  for (const FrameOutcome& frame : connected_frames(run)) {
    trajectory.push_back({frame.timestamp_ns, frame.online_camera_from_world.inverse()});
  }
  return trajectory;
}

Trajectory keyframe_trajectory(const RunOutcome& run) {
  Trajectory trajectory;
  for (const FrameOutcome& frame : connected_frames(run)) {
    if (!frame.keyframe.valid()) continue;
    if (const auto pose = camera_from_world(frame, run.final)) {
      trajectory.push_back({frame.timestamp_ns, pose->inverse()});
    }
  }
  return trajectory;
}

ExposureTrack keyframe_exposures(const RunOutcome& run, const FrozenMap& map) {
  ExposureTrack track;
  for (const FrameOutcome& frame : run.frames) {
    const auto keyframe = static_cast<size_t>(frame.keyframe.value);
    if (!frame.keyframe.valid() || keyframe >= map.keyframe_exposures.size()) continue;
    track.push_back({frame.timestamp_ns, map.keyframe_exposures[keyframe]});
  }
  return track;
}

}  // namespace photoslam
