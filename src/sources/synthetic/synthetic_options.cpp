// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/synthetic_options.h"

namespace photoslam {

void SyntheticOptions::visit(OptionVisitor& visitor) {
  visitor.value({"num_frames", "", 1, 1e6, "Length of the sequence."}, num_frames);
  visitor.value({"frames_per_second", "Hz", 1, 240, "Rate of the camera."}, frames_per_second);
  visitor.value({"width", "px", 16, 8192, "Width of the images."}, camera.width);
  visitor.value({"height", "px", 16, 8192, "Height of the images."}, camera.height);
  visitor.value({"fx", "px", 1, 1e5, "Horizontal focal length."}, camera.fx);
  visitor.value({"fy", "px", 1, 1e5, "Vertical focal length."}, camera.fy);
  visitor.value({"cx", "px", -1e5, 1e5, "Principal point, from the centre of the leftmost pixels."}, camera.cx);
  visitor.value({"cy", "px", -1e5, 1e5, "Principal point, from the centre of the topmost pixels."}, camera.cy);
  visitor.value({"seed", "", 0, 2147483647, "Another room, another shake of the hand, another noise."}, seed);
  visitor.value({"seconds_per_lap", "s", 1, 1e4, "Time of one loop; below 10 the motion gets fast."}, seconds_per_lap);
  visitor.value({"image_noise", "grey levels", 0, 50, "Standard deviation of the image noise at mid-grey."},
                image_noise);
  visitor.value(
      {"depth_noise", "m", 0, 0.1, "Standard deviation of the depth at 1 m; it grows with the square of the depth."},
      depth_noise);
  visitor.value({"depth_holes", "", 0, 1, "Share of pixels at depth edges and grazing surfaces without a depth."},
                depth_holes);
  visitor.value({"exposure_drift", "EV", 0, 4, "Largest slow change of the exposure."}, exposure_drift);
  visitor.value({"exposure_jumps", "EV", 0, 4, "Height of sudden changes of the exposure, one every 1.5 s."},
                exposure_jumps);
  visitor.value({"reflections", "", 0, 1, "Share of what glossy surfaces mirror that is seen; 0: all is matt."},
                reflections);
  visitor.value({"shutter_s", "s", 0, 0.1, "Time the shutter is open: motion blur."}, shutter_s);
  visitor.value({"readout_s", "s", 0, 0.1, "Time from the first to the last row: rolling shutter."}, readout_s);
  visitor.value({"baseline_m", "m", 0.01, 10, "Distance of the two cameras of a stereo rig."}, baseline_m);
}

RightCamera right_camera(const SyntheticOptions& options) {
  RightCamera right{options.camera, options.distortion, SE3(Quat::Identity(), Vec3(-options.baseline_m, 0, 0))};
  if (options.distortion.none()) return right;
  right.camera.fx *= 1.004;
  right.camera.fy *= 1.005;
  right.camera.cx += 0.01 * options.camera.width;
  right.camera.cy -= 0.008 * options.camera.height;
  right.distortion.k1 *= 1.02;
  right.distortion.k2 *= 0.97;
  right.right_from_left = SE3(Quat(so3_exp(Vec3(0.004, -0.006, 0.003))), Vec3(-1, 0.012, 0.02) * options.baseline_m);
  return right;
}

}  // namespace photoslam
