// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace photoslam {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

/// The cross-product matrix: hat(a) b = a × b.
inline Mat3 hat(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Rotation vector [rad] → unit quaternion, exact also near zero.
Quat so3_exp(const Vec3& omega);

/// Unit quaternion → rotation vector [rad] of norm at most π.
Vec3 so3_log(const Quat& rotation);

/// Rigid transform named `b_from_a`: x_b = R x_a + t. Compose by cancellation: c_from_a = c_from_b * b_from_a.
///
/// Tangent vectors are twists (translation first, then rotation) applied on the left: exp(ξ) * T.
struct SE3 {
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();

  SE3() = default;
  SE3(const Quat& r, const Vec3& t) : rotation(r), translation(t) {}

  Vec3 operator*(const Vec3& x) const { return rotation * x + translation; }
  SE3 operator*(const SE3& other) const;
  SE3 inverse() const;
  Mat3 matrix3() const { return rotation.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;

  static SE3 from_matrix(const Eigen::Matrix4d& m);
  /// Exponential of the twist (v, ω).
  static SE3 exp(const Vec6& twist);
  /// Inverse of exp; the rotation part has norm at most π.
  Vec6 log() const;
};

}  // namespace photoslam
