// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "localization/keyframe_proposal.h"
#include "map/snapshot.h"

namespace photoslam {

/// Keyframes that were proposed but are not in the map that tracking sees yet. Their poses follow their reference
/// keyframes, and the points they measured serve until the map has landmarks for them.
class PendingKeyframes {
 public:
  struct Point {
    int keypoint = -1;
    Vec3 in_camera = Vec3::Zero();
  };

  void add(KeyframeId id, std::shared_ptr<const FeatureFrame> frame, KeyframeId reference,
           const SE3& camera_from_reference, std::vector<Point> points);
  /// Forgets those that the map holds.
  void update(const MapSnapshot& map);
  void clear() { keyframes_.clear(); }

  /// Pose of a keyframe that is pending or in the map (which may be null).
  SE3 camera_from_world(KeyframeId id, const MapSnapshot* map) const;

  /// Calls visit(observation, keyframe's frame, point in the world) for every point, keyframe by keyframe.
  template <class Visit>
  void for_each_point(const MapSnapshot* map, Visit&& visit) const {
    for (const auto& [id, keyframe] : keyframes_) {
      const SE3 world_from_camera = camera_from_world(id, map).inverse();
      for (const Point& point : keyframe.points) {
        visit(LandmarkObservation{id, point.keypoint}, *keyframe.frame, world_from_camera * point.in_camera);
      }
    }
  }

 private:
  struct Pending {
    std::shared_ptr<const FeatureFrame> frame;
    KeyframeId reference;
    SE3 camera_from_reference;
    std::vector<Point> points;
  };
  std::map<KeyframeId, Pending> keyframes_;
};

}  // namespace photoslam
