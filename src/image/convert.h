// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "image/image.h"

namespace photoslam {

/// RGB → luma (ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B, rounded); grey images are copied.
ImageU8 to_grey(const ImageU8& image);

/// Grey → RGB; RGB images are copied.
ImageU8 to_rgb(const ImageU8& image);

/// [0, 255] → [0, 1].
ImageF to_float(const ImageU8& image);

/// [0, 1] → [0, 255], clamped and rounded; what is not a number becomes 0.
ImageU8 to_u8(const ImageF& image);

/// Value of channel c at a position inside the image: 0 ≤ x ≤ width − 1, 0 ≤ y ≤ height − 1.
template <class T>
float sample_bilinear(const Image<T>& image, float x, float y, int c = 0) {
  const int x0 = std::min(static_cast<int>(x), std::max(image.width() - 2, 0));
  const int y0 = std::min(static_cast<int>(y), std::max(image.height() - 2, 0));
  const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const auto value = [&](int px, int py) { return static_cast<float>(image(px, py, c)); };
  return (1 - fy) * ((1 - fx) * value(x0, y0) + fx * value(x1, y0)) +
         fy * ((1 - fx) * value(x0, y1) + fx * value(x1, y1));
}

}  // namespace photoslam
