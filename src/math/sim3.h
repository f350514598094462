// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "math/se3.h"

namespace photoslam {

using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;

/// Similarity named `b_from_a`: x_b = s R x_a + t. Composes by cancellation like SE3.
///
/// Tangent vectors are (translation, rotation, logarithm of the scale), applied on the left: exp(ξ) * S.
struct Sim3 {
  double scale = 1.0;
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();

  Sim3() = default;
  Sim3(double s, const Quat& r, const Vec3& t) : scale(s), rotation(r), translation(t) {}
  explicit Sim3(const SE3& rigid) : rotation(rigid.rotation), translation(rigid.translation) {}

  Vec3 operator*(const Vec3& x) const { return rotation * (scale * x) + translation; }
  Sim3 operator*(const Sim3& other) const;
  Sim3 inverse() const;
  Eigen::Matrix4d matrix() const;

  /// For b a camera: its pose in a world of the size of a, after b's own frame was shrunk by the scale.
  SE3 rigid() const { return {rotation, translation / scale}; }

  static Sim3 exp(const Vec7& tangent);
  /// Inverse of exp; the rotation part has norm at most π.
  Vec7 log() const;
  /// exp(adjoint() ξ) = S exp(ξ) S⁻¹
  Mat7 adjoint() const;
};

/// J⁻¹ with log(exp(δ) exp(ξ)) = ξ + J⁻¹ δ + O(δ²); on the other side, log(exp(ξ) exp(δ)) = ξ + J⁻¹(−ξ) δ + O(δ²).
/// Accurate to 1e-6 for rotations up to 90°.
Mat7 sim3_inverse_left_jacobian(const Vec7& tangent);

}  // namespace photoslam
