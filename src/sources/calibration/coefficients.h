// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "base/result.h"
#include "camera/distortion.h"

namespace photoslam {

/// Lens from coefficients in OpenCV's order: radial-tangential k1 k2 p1 p2 [k3 [k4 k5 k6]], fisheye k1 k2 k3 k4. An
/// empty list means no distortion. Longer lists (thin prism, tilt) are accepted where the rest is zero.
Result<Distortion> distortion_from(LensModel model, std::span<const double> coefficients);

/// "k1, k2, …" in that order, as many as any lens needs; empty without distortion.
std::string coefficients_text(const Distortion& distortion);

/// The rigid transform of the 16 numbers of a row-major 4x4 matrix, or of the first 12 of them.
Result<SE3> rigid_from_rows(std::span<const double> numbers);

}  // namespace photoslam
