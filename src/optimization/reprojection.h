// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "camera/pinhole.h"
#include "camera/pixel_observation.h"

namespace photoslam {

/// Whether an observation can take part at all. A right column that is not a number means none; infinity is an error.
inline bool is_usable(const PixelObservation& observation) {
  return observation.pixel.allFinite() && !std::isinf(observation.u_right) &&
         std::isfinite(observation.inverse_variance) && observation.inverse_variance > 0;
}

/// Huber's loss of a squared norm: itself up to delta², linear in the norm beyond. `weight` is its derivative.
struct HuberLoss {
  double value;
  double weight;
  HuberLoss(double squared, double delta) {
    if (squared <= delta * delta) {
      value = squared;
      weight = 1.0;
    } else {
      const double norm = std::sqrt(squared);
      value = 2 * delta * norm - delta * delta;
      weight = delta / norm;
    }
  }
};

/// Reprojection error of a point at x in the camera frame (z > 0), predicted minus observed, in (u, v, u_right) with
/// u_right = u − bf / z. The third coordinate is zero for an observation without depth.
struct Reprojection {
  Vec3 residual;  // [px]
  double px, py;  // The pixel relative to the principal point.
  double inverse_z;

  Reprojection(const PinholeCamera& camera, double bf, const Vec3& x, const PixelObservation& observation)
      : inverse_z(1.0 / x.z()) {
    px = camera.fx * x.x() * inverse_z;
    py = camera.fy * x.y() * inverse_z;
    const double u = px + camera.cx;
    residual << u - observation.pixel.x(), py + camera.cy - observation.pixel.y(),
        observation.has_depth() ? u - bf * inverse_z - observation.u_right : 0.0;
  }

  double chi2(const PixelObservation& observation) const {
    return observation.inverse_variance * residual.squaredNorm();
  }
};

/// First and second (Gauss-Newton) derivative of ½ weight |residual|² by the point x in the camera frame.
struct PointDerivatives {
  Vec3 gradient;
  Mat3 hessian;

  PointDerivatives(const PinholeCamera& camera, double bf, const PixelObservation& observation,
                   const Reprojection& reprojection, double weight) {
    // Rows of the Jacobian: (a, 0, b), (0, c, d) and, with depth, (a, 0, e).
    const double a = camera.fx * reprojection.inverse_z, b = -reprojection.px * reprojection.inverse_z;
    const double c = camera.fy * reprojection.inverse_z, d = -reprojection.py * reprojection.inverse_z;
    const double has_depth = observation.has_depth() ? 1.0 : 0.0;
    const double e = has_depth * (b + bf * reprojection.inverse_z * reprojection.inverse_z);
    const Vec3& r = reprojection.residual;
    gradient << a * (r[0] + r[2]), c * r[1], b * r[0] + d * r[1] + e * r[2];
    gradient *= weight;
    const double xx = weight * (1 + has_depth) * a * a, xz = weight * a * (b + e), yy = weight * c * c;
    const double yz = weight * c * d, zz = weight * (b * b + d * d + e * e);
    hessian << xx, 0, xz, 0, yy, yz, xz, yz, zz;
  }
};

/// Chain rule from the point in the camera frame to a twist on the left of camera_from_world: dx = v + ω × x.
inline Vec6 gradient_by_twist(const Vec3& x, const Vec3& gradient) {
  Vec6 result;
  result << gradient, x.cross(gradient);
  return result;
}

/// x × every column of m.
inline Mat3 cross_columns(const Vec3& x, const Mat3& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i) result.col(i) = x.cross(m.col(i));
  return result;
}

/// Adds the second derivative by the twist; of `sum` only the lower triangle counts.
inline void add_hessian_by_twist(const Vec3& x, const Mat3& hessian, Eigen::Matrix<double, 6, 6>& sum) {
  const Mat3 mixed = cross_columns(x, hessian);
  sum.topLeftCorner<3, 3>() += hessian;
  sum.bottomLeftCorner<3, 3>() += mixed;
  sum.bottomRightCorner<3, 3>() += cross_columns(x, mixed.transpose());
}

}  // namespace photoslam
