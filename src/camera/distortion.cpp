// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "camera/distortion.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace photoslam {
namespace {

constexpr int kMaxSteps = 20;
constexpr double kTolerance = 1e-12;

/// A factor on the radius, and its derivative by the squared radius.
struct Radial {
  double factor = 1;
  double by_r2 = 0;
};

Radial rational(const Distortion& d, double r2) {
  const double numerator = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  const double denominator = 1 + r2 * (d.k4 + r2 * (d.k5 + r2 * d.k6));
  const double numerator_by_r2 = d.k1 + r2 * (2 * d.k2 + r2 * 3 * d.k3);
  const double denominator_by_r2 = d.k4 + r2 * (2 * d.k5 + r2 * 3 * d.k6);
  return {numerator / denominator,
          (numerator_by_r2 * denominator - numerator * denominator_by_r2) / (denominator * denominator)};
}

/// Distorted angle of a ray at angle `a` to the axis, and its derivative (Kannala and Brandt 2006, as in OpenCV).
Radial fisheye_angle(const Distortion& d, double a) {
  const double a2 = a * a;
  return {a * (1 + a2 * (d.k1 + a2 * (d.k2 + a2 * (d.k3 + a2 * d.k4)))),
          1 + a2 * (3 * d.k1 + a2 * (5 * d.k2 + a2 * (7 * d.k3 + a2 * 9 * d.k4)))};
}

Radial fisheye(const Distortion& d, double r2) {
  constexpr double kNearAxis = 1e-8;  // there the quotients below lose all digits, and a series has them
  if (r2 < kNearAxis) return {1 + (d.k1 - 1.0 / 3) * r2, d.k1 - 1.0 / 3};
  const double r = std::sqrt(r2);
  const auto [angle, angle_derivative] = fisheye_angle(d, std::atan(r));
  const double angle_by_r = angle_derivative / (1 + r2);
  return {angle / r, (angle_by_r * r - angle) / (2 * r2 * r)};
}

/// A wide angle is far from linear in the tangent, so the inverse is sought in the angle.
std::optional<Vec2> undistort_fisheye(const Distortion& d, const Vec2& distorted) {
  const double target = distorted.norm();
  double angle = std::min(target, 0.49 * std::numbers::pi);
  for (int step = 0; step < kMaxSteps; ++step) {
    const auto [value, derivative] = fisheye_angle(d, angle);
    if (!(derivative > 0) || !(angle >= 0 && angle < 0.5 * std::numbers::pi)) return std::nullopt;
    if (std::abs(value - target) < kTolerance) {
      return target < kTolerance ? distorted : Vec2(distorted * (std::tan(angle) / target));
    }
    angle -= (value - target) / derivative;
  }
  return std::nullopt;
}

}  // namespace

Vec2 distort(const Distortion& d, const Vec2& point, Eigen::Matrix2d* jacobian) {
  const double x = point.x(), y = point.y();
  const double r2 = x * x + y * y;
  const auto [radial, radial_by_r2] = d.model == LensModel::kannala_brandt ? fisheye(d, r2) : rational(d, r2);
  if (jacobian != nullptr) {
    const double cross = 2 * x * y * radial_by_r2 + 2 * d.p1 * x + 2 * d.p2 * y;
    *jacobian << radial + 2 * x * x * radial_by_r2 + 2 * d.p1 * y + 6 * d.p2 * x, cross,  //
        cross, radial + 2 * y * y * radial_by_r2 + 6 * d.p1 * y + 2 * d.p2 * x;
  }
  return {x * radial + 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x),
          y * radial + d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y};
}

std::optional<Vec2> undistort(const Distortion& distortion, const Vec2& distorted) {
  if (distortion.model == LensModel::kannala_brandt) return undistort_fisheye(distortion, distorted);
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
