// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "camera/pinhole.h"
#include "features/matching.h"
#include "map/snapshot.h"

namespace photoslam {

/// A point that should be visible: a landmark, what a keypoint of a pending keyframe sees, or neither.
struct TrackedPoint {
  LandmarkId landmark;
  LandmarkObservation same_as;
  Vec3 position = Vec3::Zero();  ///< In the world.
};

/// Projects landmarks into a camera and says where and on which pyramid level to look for them.
class LandmarkProjector {
 public:
  LandmarkProjector(const OrbOptions& orb, const PinholeCamera& camera, double bf);

  /// Appends the landmark unless it lies outside the image, beyond the range of its descriptor or is seen from the back
  /// (more than 60° off its mean viewing direction). The radius [px] is multiplied by the scale of the predicted level.
  void add(const SE3& camera_from_world, LandmarkId id, const LandmarkView& view, float radius_px);

  /// Appends a point last seen at keypoint `index` of `seen`: the search covers its octave and both neighbours.
  void add(const SE3& camera_from_world, const TrackedPoint& point, const Features& seen, size_t index,
           float radius_px);

  void clear();
  std::span<const ProjectionQuery> queries() const { return queries_; }
  const TrackedPoint& point(size_t query) const { return points_[query]; }
  size_t size() const { return queries_.size(); }

 private:
  bool project(const SE3& camera_from_world, const Vec3& position, ProjectionQuery& query) const;

  double log_scale_factor_;
  int num_levels_;
  std::vector<float> level_scale_;
  PinholeCamera camera_;
  double bf_;
  std::vector<ProjectionQuery> queries_;
  std::vector<TrackedPoint> points_;
};

}  // namespace photoslam
