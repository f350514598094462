// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "camera/pinhole.h"
#include "image/image.h"
#include "math/se3.h"
#include "splatting/gaussian.h"
#include "splatting/renderer.h"
#include "splatting/view.h"

namespace photoslam {

/// The camera as the splatting engine takes it.
splatting::Camera to_splatting(const PinholeCamera& camera);

/// The render as an image; planes become interleaved, values are clamped to [0, 1].
ImageF to_image(const splatting::RenderResult& render);

/// Where a camera is, seen from every anchor keyframe: composed in double precision, so that nothing is lost far from
/// the origin. Writes [anchors] poses.
void camera_from_anchors(const SE3& camera_from_world, std::span<const SE3> anchors_from_world,
                         std::vector<splatting::Pose>& camera_from_anchor);

/// Where a gaussian is, in the frame of the camera.
Vec3 in_camera(const splatting::Pose& camera_from_anchor, const splatting::Gaussian& gaussian);

}  // namespace photoslam
