// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "math/se3.h"

namespace photoslam {

/// Radial-tangential distortion as in OpenCV; all zero means none.
struct Distortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  bool none() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
  bool operator==(const Distortion&) const = default;
};

/// Where the lens puts the ray through (x, y, 1): normalised coordinates in, distorted normalised coordinates out.
/// `jacobian`, if given, receives the derivative of the result by `point`.
Vec2 distort(const Distortion& distortion, const Vec2& point, Eigen::Matrix2d* jacobian = nullptr);

/// Inverse of distort() by Newton's method; nothing where the model has no unique inverse (far outside the image).
std::optional<Vec2> undistort(const Distortion& distortion, const Vec2& distorted);

}  // namespace photoslam
