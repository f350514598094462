// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "run_images.h"

#include <map>

#include "pipeline/frame_rectifier.h"
#include "run_folder.h"

namespace photoslam {

Status for_each_keyframe_image(const std::filesystem::path& run,
                               const std::function<Status(FrameId, const PosedCamera&, ImageU8)>& take) {
  const auto description = read_run_description(run);
  if (!description) return description.error();
  const auto keyframes = read_tum_trajectory(run / "keyframes.tum");
  if (!keyframes) return keyframes.error();
  auto source = open_source(description->dataset, description->source);
  if (!source) return source.error();
  std::map<int64_t, SE3> pose_at;
  for (const StampedPose& pose : *keyframes) pose_at[pose.timestamp_ns] = pose.world_from_camera.inverse();
  const FrameRectifier rectifier((*source)->info());
  while (auto frame = (*source)->next()) {
    const auto pose = pose_at.find(frame->timestamp_ns);
    if (pose == pose_at.end() || !frame->defect.empty()) continue;
    const PosedCamera camera{rectifier.camera(), pose->second, {}};
    if (Status status = take(frame->id, camera, rectifier.color(std::move(frame->color))); !status) return status;
  }
  return {};
}

}  // namespace photoslam
