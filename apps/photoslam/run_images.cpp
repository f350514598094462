// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "run_images.h"

#include <algorithm>
#include <map>

#include "pipeline/frame_rectifier.h"
#include "run_folder.h"

namespace photoslam {

std::vector<SparsePoint> sparse_points(const GaussianTable& map) {
  constexpr size_t kSparsePoints = 20000;
  constexpr float kSh0 = 0.28209479177387814f;
  std::vector<std::pair<float, size_t>> order;
  for (size_t i = 0; i < map.size(); ++i) order.emplace_back(-map.row(i)[GaussianTable::kOpacity], i);
  std::ranges::sort(order);
  order.resize(std::min(order.size(), kSparsePoints));
  std::vector<SparsePoint> points;
  for (const auto& entry : order) {
    const auto row = map.row(entry.second);
    SparsePoint& point = points.emplace_back();
    for (int k = 0; k < 3; ++k) point.position[k] = static_cast<double>(row[static_cast<size_t>(k)]);
    for (size_t c = 0; c < 3; ++c) {
      const float value = 255 * (0.5f + kSh0 * row[GaussianTable::kShDc + c]);
      point.color[c] = static_cast<uint8_t>(std::clamp(value, 0.0f, 255.0f));
    }
  }
  return points;
}

Status for_each_keyframe_image(const std::filesystem::path& run, const std::function<Status(KeyframeImage)>& take) {
  const auto description = read_run_description(run);
  if (!description) return description.error();
  const auto keyframes = read_tum_trajectory(run / "keyframes.tum");
  if (!keyframes) return keyframes.error();
  auto source = open_run_source(run, *description);
  if (!source) return source.error();
  std::map<int64_t, SE3> pose_at;
  for (const StampedPose& pose : *keyframes) pose_at[pose.timestamp_ns] = pose.world_from_camera.inverse();
  const FrameRectifier rectifier((*source)->info());
  std::shared_ptr<const ImageU8> mask;
  if (!rectifier.mask().empty()) mask = std::make_shared<const ImageU8>(rectifier.mask());
  while (auto frame = (*source)->next()) {
    const auto pose = pose_at.find(frame->timestamp_ns);
    if (pose == pose_at.end() || !frame->defect.empty()) continue;
    KeyframeImage keyframe{frame->id, frame->timestamp_ns, {rectifier.camera(), pose->second, {}}, {}, mask};
    keyframe.image = rectifier.color(std::move(frame->color));
    if (Status status = take(std::move(keyframe)); !status) return status;
  }
  return {};
}

}  // namespace photoslam
