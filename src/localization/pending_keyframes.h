// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "localization/keyframe_proposal.h"
#include "map/snapshot.h"

namespace photoslam {

/// Keyframes that were proposed but are not in the map that tracking sees yet. Their poses follow their reference
/// keyframes, and the points they measured serve until the map has landmarks for them. When a correction changes the
/// scale of the reference in the meantime, everything measured since grows with it, as it will when the keyframe enters
/// the map.
class PendingKeyframes {
 public:
  struct Point {
    int keypoint = -1;
    Vec3 in_camera = Vec3::Zero();
  };

  /// `reference_scale`: of the reference keyframe as scale() gives it now.
  void add(KeyframeId id, std::shared_ptr<const FeatureFrame> frame, KeyframeId reference,
           const SE3& camera_from_reference, double reference_scale, std::vector<Point> points);
  /// Forgets those that the map holds.
  void update(const MapSnapshot& map);
  void clear() { keyframes_.clear(); }

  /// Pose of a keyframe that is pending or in the map (which may be null).
  SE3 camera_from_world(KeyframeId id, const MapSnapshot* map) const;
  /// Its Keyframe::scale, or what that would be if it entered the map now; 1 without a keyframe.
  double scale(KeyframeId id, const MapSnapshot* map) const;
  /// The point in the world that a pending keyframe measured at a keypoint, if it did.
  std::optional<Vec3> point(const LandmarkObservation& seen, const MapSnapshot* map) const;

  /// Calls visit(observation, keyframe's frame, point in the world) for every point, keyframe by keyframe.
  template <class Visit>
  void for_each_point(const MapSnapshot* map, Visit&& visit) const {
    for (const auto& [id, keyframe] : keyframes_) {
      const SE3 world_from_camera = camera_from_world(id, map).inverse();
      const double unit = scale(id, map);
      for (const Point& point : keyframe.points) {
        visit(LandmarkObservation{id, point.keypoint}, *keyframe.frame, world_from_camera * (unit * point.in_camera));
      }
    }
  }

 private:
  struct Pending {
    std::shared_ptr<const FeatureFrame> frame;
    KeyframeId reference;
    SE3 camera_from_reference;
    double reference_scale;
    std::vector<Point> points;  // by keypoint
  };
  std::map<KeyframeId, Pending> keyframes_;
};

}  // namespace photoslam
