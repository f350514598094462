// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/options.h"
#include "camera/pinhole.h"

namespace photoslam {

/// What a synthetic sequence shows and how it is filmed. The same options give the same bytes.
struct SyntheticOptions {
  int num_frames = 300;
  double frames_per_second = 30;
  PinholeCamera camera = {.width = 640, .height = 480, .fx = 525.4, .fy = 524.6, .cx = 326.8, .cy = 233.4};
  int seed = 1;                 ///< Drives the furnishing, the textures, the hand's shake and the noise.
  double seconds_per_lap = 10;  ///< Time of the first loop; the whole tour of the room takes three times as long.
  double image_noise = 1.5;     ///< σ of the image noise at mid-grey [grey levels]; less in the shadows.
  double depth_noise = 0.001;   ///< σ of the depth at 1 m [m]; grows with the square of the depth.
  double depth_holes = 0.5;     ///< Share of the pixels at depth edges and grazing surfaces without a measurement.
  double exposure_drift = 0;    ///< Largest slow change of the exposure [EV, factors of two].

  void visit(OptionVisitor& visitor);
};

}  // namespace photoslam
