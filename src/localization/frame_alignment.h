// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "features/matching.h"
#include "geometry/absolute_pose.h"
#include "localization/landmark_projection.h"
#include "map/snapshot.h"
#include "optimization/pose_refinement.h"

namespace photoslam {

/// Points assigned to the keypoints of a frame.
struct FrameMatches {
  std::vector<TrackedPoint> point;  ///< [N] where matched
  std::vector<uint8_t> matched;     ///< [N]
  explicit FrameMatches(size_t n = 0) : point(n), matched(n, 0) {}
};

/// The two steps that every pose is made of: finding projected points in a frame, and motion-only bundle adjustment,
/// Eq. (1), over what was found. Keeps its buffers between calls.
class FrameAlignment {
 public:
  FrameAlignment(const PoseRefinementOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf)
      : options_(options), camera_(camera), bf_(bf), projector_(orb, camera, bf) {}

  const PinholeCamera& camera() const { return camera_; }
  /// What to look for: filled by the caller, searched by match().
  LandmarkProjector& projector() { return projector_; }

  /// Fills `projector()` with the landmarks that the keyframes see, each once, but for those matched already.
  void project_landmarks(const SE3& camera_from_world, const MapSnapshot& map, const std::vector<KeyframeId>& keyframes,
                         float radius_px, const FrameMatches& matches);

  /// Adds matches of projected points with keypoints that have none; returns how many.
  int match(const FeatureFrame& frame, const MatchOptions& options, FrameMatches& matches);

  /// The pose with which most of the matches agree, found without a prior; drops the others.
  std::optional<SE3> estimate(const PoseRansacOptions& options, const FeatureFrame& frame, FrameMatches& matches) const;

  /// Moves the pose to where the matches fit best and drops those that do not; returns the number of inliers, 0 when
  /// there is no pose.
  int refine(const FeatureFrame& frame, FrameMatches& matches, SE3& camera_from_world) const;

 private:
  PoseRefinementOptions options_;
  PinholeCamera camera_;
  double bf_;
  LandmarkProjector projector_;
  ProjectionMatcher matcher_;
  std::vector<float> u_right_;
  std::vector<int> keypoint_of_query_;
};

}  // namespace photoslam
