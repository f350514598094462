// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "math/se3.h"

namespace photoslam {

enum class LensModel {
  radial_tangential,  ///< OpenCV: k1 k2 p1 p2 k3, and with the rational part k4 k5 k6; all zero means no distortion.
  kannala_brandt,     ///< OpenCV's fisheye: k1 k2 k3 k4 of the angle; p1, p2, k5 and k6 are 0.
};

/// How a lens departs from the pinhole.
struct Distortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  double k4 = 0, k5 = 0, k6 = 0;
  LensModel model = LensModel::radial_tangential;
  bool none() const { return *this == Distortion{}; }
  bool operator==(const Distortion&) const = default;
};

/// Where the lens puts the ray through (x, y, 1): normalised coordinates in, distorted normalised coordinates out.
/// `jacobian`, if given, receives the derivative of the result by `point`.
Vec2 distort(const Distortion& distortion, const Vec2& point, Eigen::Matrix2d* jacobian = nullptr);

/// Inverse of distort() by Newton's method; nothing where the model has no unique inverse (far outside the image), or
/// where the ray is 90° or more off the axis.
std::optional<Vec2> undistort(const Distortion& distortion, const Vec2& distorted);

}  // namespace photoslam
