// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/pending_keyframes.h"

namespace photoslam {

void PendingKeyframes::add(KeyframeId id, std::shared_ptr<const FeatureFrame> frame, KeyframeId reference,
                           const SE3& camera_from_reference, std::vector<Point> points) {
  keyframes_[id] = {std::move(frame), reference, camera_from_reference, std::move(points)};
}

void PendingKeyframes::update(const MapSnapshot& map) {
  std::erase_if(keyframes_, [&](const auto& entry) { return map.has(entry.first); });
}

SE3 PendingKeyframes::camera_from_world(KeyframeId id, const MapSnapshot* map) const {
  if (map != nullptr && map->has(id)) return map->keyframe(id).keyframe.camera_from_world;
  const Pending& pending = keyframes_.at(id);
  if (!pending.reference.valid()) return pending.camera_from_reference;
  return pending.camera_from_reference * camera_from_world(pending.reference, map);
}

}  // namespace photoslam
