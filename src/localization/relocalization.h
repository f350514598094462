// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "base/options.h"
#include "features/place_index.h"
#include "geometry/absolute_pose.h"
#include "localization/frame_alignment.h"
#include "localization/place_evidence.h"

namespace photoslam {

struct RelocalizationOptions {
  int max_candidates = 4;  ///< Keyframes tried per frame.
  int min_matches = 15;
  int min_inliers = 40;
  double search_radius_px = 8.0;
  PlaceEvidenceOptions evidence{.min_matched_share = 0.2, .min_coverage = 0.3};  ///< Views from elsewhere find less.
  PoseRansacOptions pose_ransac;
  void visit(OptionVisitor& visitor);
};

/// A pose found without a prior, and the keyframe it was found with.
struct Relocalization {
  SE3 camera_from_world;
  KeyframeId keyframe;
};

/// Finds the pose of a frame in the map without a prior: keyframes of places that look alike, descriptor matches with
/// each, robust perspective-n-point, guided search of the landmarks around, refinement. Deterministic.
class Relocalizer {
 public:
  Relocalizer(const RelocalizationOptions& options, FrameAlignment alignment)
      : options_(options), alignment_(std::move(alignment)) {}

  /// Files the keyframes that are new in the map, and takes out those that were culled: others see what they saw.
  void update(const MapSnapshot& map);

  /// `likely` is tried first if it is in the map. update() must have seen the map.
  std::optional<Relocalization> relocalize(const MapSnapshot& map, const FeatureFrame& frame, KeyframeId likely);

 private:
  std::optional<SE3> pose_against(const MapSnapshot& map, const FeatureFrame& frame, KeyframeId candidate);
  std::optional<SE3> verified(const MapSnapshot& map, const FeatureFrame& frame, KeyframeId candidate, SE3 pose);
  /// What the frame shows of what was last projected into it.
  PlaceEvidence evidence(const FeatureFrame& frame, const FrameMatches& matches);

  RelocalizationOptions options_;
  FrameAlignment alignment_;
  PlaceIndex places_;
  int num_filed_ = 0;
};

}  // namespace photoslam
