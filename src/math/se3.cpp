// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "math/se3.h"

#include <cmath>

namespace photoslam {
namespace {

/// sin(θ)/θ, (1 − cos θ)/θ² and (θ − sin θ)/θ³ with their series near zero.
struct RotationCoefficients {
  double a, b, c;
  explicit RotationCoefficients(double theta) {
    const double t2 = theta * theta;
    if (theta < 1e-3) {
      a = 1.0 - t2 / 6.0 + t2 * t2 / 120.0;
      b = 0.5 - t2 / 24.0 + t2 * t2 / 720.0;
      c = 1.0 / 6.0 - t2 / 120.0 + t2 * t2 / 5040.0;
    } else {
      a = std::sin(theta) / theta;
      b = (1.0 - std::cos(theta)) / t2;
      c = (theta - std::sin(theta)) / (t2 * theta);
    }
  }
};

/// V(ω) with translation = V(ω) v in the exponential of (v, ω).
Mat3 left_jacobian(const Vec3& omega) {
  const RotationCoefficients k(omega.norm());
  const Mat3 w = hat(omega);
  return Mat3::Identity() + k.b * w + k.c * w * w;
}

}  // namespace

Quat so3_exp(const Vec3& omega) {
  const double theta = omega.norm();
  const double half = 0.5 * theta;
  // sin(θ/2)/θ
  const double k = theta < 1e-4 ? 0.5 - theta * theta / 48.0 : std::sin(half) / theta;
  return Quat(std::cos(half), k * omega.x(), k * omega.y(), k * omega.z()).normalized();
}

Vec3 so3_log(const Quat& rotation) {
  const double sign = rotation.w() < 0 ? -1.0 : 1.0;
  const Vec3 v = sign * rotation.vec();
  const double w = sign * rotation.w();
  const double n = v.norm();
  if (n < 1e-9) return 2.0 / w * v;
  return 2.0 * std::atan2(n, w) / n * v;
}

SE3 SE3::operator*(const SE3& other) const {
  return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
}

SE3 SE3::inverse() const {
  const Quat r = rotation.conjugate();
  return {r, -(r * translation)};
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = matrix3();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

SE3 SE3::from_matrix(const Eigen::Matrix4d& m) {
  return {Quat(Mat3(m.topLeftCorner<3, 3>())).normalized(), m.topRightCorner<3, 1>()};
}

SE3 SE3::exp(const Vec6& twist) {
  const Vec3 omega = twist.tail<3>();
  return {so3_exp(omega), left_jacobian(omega) * twist.head<3>()};
}

Vec6 SE3::log() const {
  const Vec3 omega = so3_log(rotation);
  Vec6 twist;
  twist << left_jacobian(omega).inverse() * translation, omega;
  return twist;
}

}  // namespace photoslam
