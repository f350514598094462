// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "camera/pinhole.h"
#include "math/se3.h"

namespace photoslam {

/// One camera's view of a point to be triangulated.
struct PointView {
  SE3 camera_from_world;
  Vec2 pixel = Vec2::Zero();
  double sigma = 1.0;  ///< Standard deviation of the pixel [px].
};

struct TriangulationLimits {
  double min_parallax = 0.0175;  ///< Angle between the two rays [rad].
  double max_chi2 = 5.991;       ///< Squared reprojection error over σ² in either view.
};

/// The point seen in two views, in the world frame; nothing when the rays are nearly parallel, the point lies behind a
/// camera, or it does not reproject. Midpoint weighted for the smallest reprojection error (inverse-depth weighted).
std::optional<Vec3> triangulate(const PinholeCamera& camera, const PointView& a, const PointView& b,
                                const TriangulationLimits& limits = {});

/// Angle [rad] at `point` between the directions to two camera centres (all in the world frame).
double parallax_angle(const Vec3& point, const Vec3& center_a, const Vec3& center_b);

}  // namespace photoslam
