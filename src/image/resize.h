// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/pinhole.h"
#include "image/image.h"

namespace photoslam {

/// The image at another size, each new pixel the mean over the area it covers (when shrinking).
ImageU8 resize(const ImageU8& image, int width, int height);

/// The camera of the resized image: pixel areas correspond, so x_new = (x + ½) s − ½ per axis.
PinholeCamera resize(const PinholeCamera& camera, int width, int height);

}  // namespace photoslam
