// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/distortion.h"
#include "camera/pinhole.h"

namespace photoslam {

/// A camera as calibrated: intrinsics of its raw image, and its lens.
struct CalibratedCamera {
  PinholeCamera camera;
  Distortion distortion;
};

/// How two cameras become a pair of equal pinhole cameras that differ by a shift along their x axes: a point at depth z
/// appears in the same row of both, in the right image fx * baseline / z columns further left.
struct StereoRectification {
  PinholeCamera camera;                         ///< Of both rectified images.
  double baseline_m = 0;                        ///< Distance of the camera centres.
  Quat rectified_from_left = Quat::Identity();  ///< Rotation of each camera into the common orientation.
  Quat rectified_from_right = Quat::Identity();
  bool is_identity = false;  ///< The images are rectified as they are: nothing to resample.
};

/// The turns are shared evenly by both cameras, and what both see is centred in the image, whose size is that of the
/// left camera's. Assumes a right camera roughly to the right of the left one.
StereoRectification rectify_stereo(const CalibratedCamera& left, const CalibratedCamera& right,
                                   const SE3& right_from_left);

}  // namespace photoslam
