// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "camera/distortion.h"

#include <Eigen/LU>

namespace photoslam {

Vec2 distort(const Distortion& d, const Vec2& point, Eigen::Matrix2d* jacobian) {
  const double x = point.x(), y = point.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  if (jacobian != nullptr) {
    const double radial_by_r2 = d.k1 + r2 * (2 * d.k2 + r2 * 3 * d.k3);
    const double cross = 2 * x * y * radial_by_r2 + 2 * d.p1 * x + 2 * d.p2 * y;
    *jacobian << radial + 2 * x * x * radial_by_r2 + 2 * d.p1 * y + 6 * d.p2 * x, cross,  //
        cross, radial + 2 * y * y * radial_by_r2 + 6 * d.p1 * y + 2 * d.p2 * x;
  }
  return {x * radial + 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x),
          y * radial + d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y};
}

std::optional<Vec2> undistort(const Distortion& distortion, const Vec2& distorted) {
  constexpr int kMaxSteps = 20;
  constexpr double kTolerance = 1e-12;
  Vec2 point = distorted;
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix2d jacobian;
    const Vec2 residual = distort(distortion, point, &jacobian) - distorted;
    // A lens maps rays in order; where the model folds over, there is no inverse to follow.
    if (!(jacobian.determinant() > 0)) return std::nullopt;
    if (residual.norm() < kTolerance) return point;
    point -= jacobian.inverse() * residual;
  }
  return std::nullopt;
}

}  // namespace photoslam
