// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "math/se3.h"
#include "photorealistic_mapping/depth_picture.h"

namespace photoslam {

/// Another picture whose depth has been measured, too.
struct MeasuredView {
  const DepthPicture* picture = nullptr;
  SE3 other_from_view;
};

/// The depths of a view that another's agree with: seen from there the point is as far as was measured there, by
/// `tolerance` of its distance. [H, W] metres, 0 elsewhere.
ImageF confirmed_depth(const DepthPicture& view, std::span<const MeasuredView> others, double tolerance);

}  // namespace photoslam
