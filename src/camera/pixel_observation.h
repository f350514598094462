// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include "math/se3.h"

namespace photoslam {

/// A landmark seen in an image. With depth (RGB-D or stereo) it has a third coordinate: the column u_right = u − bf / z
/// at which a right camera at baseline b would see it, whose error in pixels is independent of the depth.
struct PixelObservation {
  Vec2 pixel = Vec2::Zero();
  double u_right = std::numeric_limits<double>::quiet_NaN();  ///< NaN: monocular observation.
  double inverse_variance = 1.0;                              ///< 1 / σ² of each coordinate [1/px²].
  bool has_depth() const { return !std::isnan(u_right); }
};

}  // namespace photoslam
