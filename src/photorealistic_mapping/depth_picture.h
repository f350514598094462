// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/pinhole.h"
#include "image/image.h"

namespace photoslam {

/// A picture with what is known of its depth; images of the camera's size.
struct DepthPicture {
  PinholeCamera camera;
  ImageU8 color;  ///< RGB or grey.
  ImageF depth;   ///< [m]; 0 where unknown, empty when nothing is known at all.
  ImageU8 mask;   ///< 0 where there is no data; empty when there is data everywhere.
  bool has_data(size_t pixel) const { return mask.empty() || mask.values()[pixel] != 0; }
};

}  // namespace photoslam
