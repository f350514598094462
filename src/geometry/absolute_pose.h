// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/options.h"
#include "camera/pinhole.h"
#include "math/se3.h"

namespace photoslam {

/// Camera poses that see three points in three directions: up to four solutions of the perspective-three-point problem.
///
/// points_in_world and rays_in_camera (unit length) correspond. Writes `camera_from_world`, returns their number.
int solve_p3p(const Vec3 points_in_world[3], const Vec3 rays_in_camera[3], SE3 camera_from_world[4]);

struct PoseRansacOptions {
  int max_iterations = 300;
  int min_inliers = 12;       ///< Fewer count as a failure.
  double max_error_px = 4.0;  ///< Reprojection error of an inlier at σ = 1 px.
  double confidence = 0.999;  ///< Stops when a better sample is this unlikely.
  int seed = 1;
  void visit(OptionVisitor& visitor);
};

struct PoseRansacResult {
  bool success = false;
  SE3 camera_from_world;
  std::vector<uint8_t> inlier;  ///< One per correspondence.
  int num_inliers = 0;
  int iterations = 0;
};

/// The pose of a camera from correspondences of which many may be wrong, without any prior: P3P in RANSAC with local
/// optimisation, then Gauss-Newton over the inliers. Deterministic for a given seed.
///
/// points_in_world and pixels correspond; sigmas [px] scale the threshold per pixel (empty: all 1).
PoseRansacResult estimate_pose_ransac(const PoseRansacOptions& options, const PinholeCamera& camera,
                                      std::span<const Vec3> points_in_world, std::span<const Vec2> pixels,
                                      std::span<const double> sigmas = {});

}  // namespace photoslam
