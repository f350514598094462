// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "base/options.h"
#include "geometry/absolute_pose.h"
#include "map/snapshot.h"

namespace photoslam {

struct RelocalizationOptions {
  int max_candidates = 5;  ///< Keyframes tried per frame.
  int min_matches = 20;
  PoseRansacOptions pose_ransac;
  void visit(OptionVisitor& visitor);
};

/// Finds the pose of a frame in the map without a prior: descriptor matches against candidate keyframes, then robust
/// perspective-n-point. Candidates rotate through the whole map from call to call (`attempt` counts them), the most
/// recent keyframe first, so that every place is tried within keyframes / max_candidates frames.
std::optional<SE3> relocalize(const RelocalizationOptions& options, const PinholeCamera& camera, const MapSnapshot& map,
                              const FeatureFrame& frame, int attempt);

}  // namespace photoslam
