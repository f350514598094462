// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_rectifier.h"

#include "image/rectification.h"

namespace photoslam {

FrameRectifier::FrameRectifier(const SourceInfo& info) : camera_(info.camera) {
  if (info.sensor == SensorKind::stereo) {
    PHOTOSLAM_CHECK(info.right.has_value(), "{}: a stereo source without a right camera", info.name);
    const StereoRectification r = rectify_stereo(
        {info.camera, info.distortion}, {info.right->camera, info.right->distortion}, info.right->right_from_left);
    camera_ = r.camera;
    baseline_m_ = r.baseline_m;
    rectified_from_left_ = r.rectified_from_left;
    if (r.is_identity) return;
    left_.emplace(info.camera, info.distortion, r.camera, r.rectified_from_left);
    right_.emplace(info.right->camera, info.right->distortion, r.camera, r.rectified_from_right);
  } else if (!info.distortion.none()) {
    left_.emplace(info.camera, info.distortion);
  }
}

}  // namespace photoslam
