// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/pinhole.h"
#include "image/image.h"

namespace photoslam {

/// What a camera saw, pixel by pixel. Depth and mask may be absent (empty); else all have the camera's size.
struct CameraView {
  PinholeCamera camera;
  ImageU8 color;   ///< RGB or grey.
  ImageU16 depth;  ///< 0 = no measurement.
  ImageU8 mask;    ///< Not 0 where there is data.
};

/// The view at 1/factor of the resolution: images and camera together, so that they always fit.
///
/// Colour is the mean over factor x factor blocks (rounded), a true low-pass; the mask keeps blocks whose every pixel
/// has data; depth is the median of a block's measurements, where at least half of its pixels have one, so that no
/// depth between two surfaces is invented. A rest at the right and bottom is dropped; factor ≥ 1.
CameraView shrink(const CameraView& view, int factor);

/// The parts of it.
ImageU8 shrink_color(const ImageU8& color, int factor);
ImageF shrink_color(const ImageF& color, int factor);
ImageU16 shrink_depth(const ImageU16& depth, int factor);
ImageU8 shrink_mask(const ImageU8& mask, int factor);

}  // namespace photoslam
