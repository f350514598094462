// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/options.h"
#include "camera/pinhole.h"
#include "camera/pixel_observation.h"
#include "math/se3.h"

namespace photoslam {

struct PoseRefinementOptions {
  int rounds = 4;  ///< Inliers are chosen anew after each round.
  int iterations_per_round = 10;
  double chi2_mono = 5.991;   ///< 95 % of χ² with 2 degrees of freedom.
  double chi2_depth = 7.815;  ///< 95 % of χ² with 3 degrees of freedom.
  void visit(OptionVisitor& visitor);
};

struct PoseRefinementResult {
  SE3 camera_from_world;
  std::vector<uint8_t> inlier;  ///< One per observation.
  int num_inliers = 0;
  double cost = 0;         ///< ½ Σ ρ over the inliers of the last round.
  bool converged = false;  ///< At least 4 inliers and a finite pose; otherwise the initial pose is returned.
};

/// Motion-only bundle adjustment, Eq. (1) of Photo-SLAM: the pose that minimises the robust reprojection error of known
/// points, by Levenberg-Marquardt with a Huber kernel (switched off for the last round). Points behind the camera and
/// values that are not finite count as outliers. Deterministic.
///
/// points_in_world and observations correspond index by index; bf = fx * baseline [px m] (0 when nothing has depth).
PoseRefinementResult refine_pose(const PoseRefinementOptions& options, const PinholeCamera& camera, double bf,
                                 std::span<const Vec3> points_in_world, std::span<const PixelObservation> observations,
                                 const SE3& initial_camera_from_world);

}  // namespace photoslam
