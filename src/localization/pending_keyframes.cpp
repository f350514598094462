// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/pending_keyframes.h"

#include <algorithm>

namespace photoslam {

void PendingKeyframes::add(KeyframeId id, std::shared_ptr<const FeatureFrame> frame, KeyframeId reference,
                           const SE3& camera_from_reference, double reference_scale, std::vector<Point> points) {
  std::ranges::sort(points, {}, &Point::keypoint);
  keyframes_[id] = {std::move(frame), reference, camera_from_reference, reference_scale, std::move(points)};
}

void PendingKeyframes::update(const MapSnapshot& map) {
  std::erase_if(keyframes_, [&](const auto& entry) { return map.has(entry.first); });
}

SE3 PendingKeyframes::camera_from_world(KeyframeId id, const MapSnapshot* map) const {
  if (map != nullptr && map->has(id)) return map->keyframe(id).keyframe.camera_from_world;
  const Pending& pending = keyframes_.at(id);
  if (!pending.reference.valid()) return pending.camera_from_reference;
  SE3 camera_from_reference = pending.camera_from_reference;
  camera_from_reference.translation *= scale(id, map);
  return camera_from_reference * camera_from_world(pending.reference, map);
}

double PendingKeyframes::scale(KeyframeId id, const MapSnapshot* map) const {
  if (map != nullptr && map->has(id)) return map->keyframe(id).keyframe.scale;
  const auto pending = keyframes_.find(id);
  if (pending == keyframes_.end() || !pending->second.reference.valid()) return 1.0;
  return scale(pending->second.reference, map) / pending->second.reference_scale;
}

std::optional<Vec3> PendingKeyframes::point(const LandmarkObservation& seen, const MapSnapshot* map) const {
  const auto pending = keyframes_.find(seen.keyframe);
  if (pending == keyframes_.end()) return std::nullopt;
  const std::vector<Point>& points = pending->second.points;
  const auto found = std::ranges::lower_bound(points, seen.keypoint, {}, &Point::keypoint);
  if (found == points.end() || found->keypoint != seen.keypoint) return std::nullopt;
  return camera_from_world(seen.keyframe, map).inverse() * (scale(seen.keyframe, map) * found->in_camera);
}

}  // namespace photoslam
