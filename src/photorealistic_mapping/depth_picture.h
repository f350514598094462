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
};

}  // namespace photoslam
