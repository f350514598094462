// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace photoslam::splatting {

struct Camera;
struct Pose;
struct RenderOptions;

/// A camera as seen from one anchor. The centre is split in two floats, so that subtracting it from a mean is exact to
/// fp32 of the difference, however far from the anchor's origin both are.
struct AnchorView {
  float rotation[9];    ///< camera_from_anchor, row-major.
  float center[3];      ///< Camera centre in the anchor frame, rounded …
  float center_low[3];  ///< … and what rounding lost.
  float fx, fy, cx, cy;
  float min_x, max_x, min_y, max_y;  ///< Clamp of x/z and y/z in the Jacobian.
  float near;
  float low_pass;       ///< Variance added to the screen covariance [px²] …
  float full_low_pass;  ///< … of which this is added in the full picture, where peaks are as high as opacities [px²].
};

/// Through intrinsics that are not numbers nothing is drawn.
AnchorView make_anchor_view(const Pose& camera_from_anchor, const Camera& camera, const RenderOptions& options);

}  // namespace photoslam::splatting
