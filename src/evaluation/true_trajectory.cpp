// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/true_trajectory.h"

#include "pipeline/frame_rectifier.h"

namespace photoslam {

Trajectory of_tracked_camera(Trajectory of_left_camera, const SourceInfo& source) {
  const SE3 rectified_from_left(FrameRectifier(source).rectified_from_left(), Vec3::Zero());
  const SE3 left_from_rectified = rectified_from_left.inverse();
  for (StampedPose& pose : of_left_camera) pose.world_from_camera = pose.world_from_camera * left_from_rectified;
  return of_left_camera;
}

Result<Trajectory> read_true_trajectory(const std::filesystem::path& path, const SourceInfo& source) {
  auto truth = read_ground_truth(path);
  if (!truth) return truth.error();
  return of_tracked_camera(std::move(*truth), source);
}

}  // namespace photoslam
