// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "map/map.h"
#include "map/testing/point_world.h"

namespace photoslam::testing {

/// Puts every keyframe into a map with exact poses and points.
class IdealMapper {
 public:
  explicit IdealMapper(const PointWorld& world)
      : world_(world), map_(1.2, 8), landmark_of_point_(world.points.size()) {}

  void add(KeyframeId id, std::shared_ptr<const FeatureFrame> frame, const SE3& true_pose,
           const std::vector<int>& point_of_keypoint) {
    map_.add_keyframe(id, std::move(frame), true_pose);
    for (size_t i = 0; i < point_of_keypoint.size(); ++i) {
      const auto point = static_cast<size_t>(point_of_keypoint[i]);
      LandmarkId& landmark = landmark_of_point_[point];
      if (landmark.valid()) {
        map_.add_observation(landmark, id, static_cast<int>(i));
        map_.update_view(landmark);
      } else {
        landmark = map_.add_landmark(world_.points[point], id, static_cast<int>(i));
      }
    }
  }
  void cull(KeyframeId id, KeyframeId parent) {
    map_.set_parent(id, parent);
    map_.cull_keyframe(id);
  }
  void apply(const MapCorrection& correction) { map_.apply(correction); }
  std::shared_ptr<const MapSnapshot> snapshot() { return map_.snapshot(); }

 private:
  const PointWorld& world_;
  Map map_;
  std::vector<LandmarkId> landmark_of_point_;
};

/// How far apart two poses are: metres and radians.
struct PoseError {
  double position = 0, rotation = 0;
};

inline PoseError pose_error(const SE3& estimate, const SE3& truth) {
  const SE3 difference = estimate * truth.inverse();
  return {difference.translation.norm(), so3_log(difference.rotation).norm()};
}

}  // namespace photoslam::testing
