// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/options.h"
#include "camera/distortion.h"
#include "camera/pinhole.h"
#include "sources/frame.h"

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
  double exposure_jumps = 0;    ///< Height of sudden changes of the exposure, one every 1.5 s [EV].
  double reflections = 1;       ///< Share of what glossy surfaces mirror that is seen; 0: everything is matt.
  double shutter_s = 0;         ///< Time the shutter is open [s]: motion blur.
  double readout_s = 0;         ///< Time from the first to the last row [s]: rolling shutter.
  SensorKind sensor = SensorKind::rgbd;
  Distortion distortion = {};  ///< Of the lens; the right camera's differs a little.
  double baseline_m = 0.11;    ///< Of the stereo rig.

  void visit(OptionVisitor& visitor);
};

/// The right camera of the rig. With a lens, it is built and mounted as exactly as real ones are: not quite the same,
/// and not quite parallel.
RightCamera right_camera(const SyntheticOptions& options);

}  // namespace photoslam
