// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "base/executor.h"
#include "splatting/cpu/frame.h"
#include "splatting/renderer.h"

namespace photoslam::splatting {

/// Blends every tile front to back (paper Eq. 3) and notes in cell_masks which cells each entry contributed to.
void rasterize(Executor& executor, Frame& frame, RenderResult& result);

/// dL/d(image): planes as in RenderResult; depth and alpha may be empty (zero).
struct ImageGradient {
  std::span<const float> rgb;    // [3, H, W]
  std::span<const float> depth;  // [H, W]
  std::span<const float> alpha;  // [H, W]
};

/// Walks every tile again, front to back, and fills frame.gradients: one record per (gaussian, tile).
void rasterize_backward(Executor& executor, Frame& frame, const RenderResult& result, const ImageGradient& gradient);

}  // namespace photoslam::splatting
