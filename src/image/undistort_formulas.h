// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How one pixel of an undistorted image comes from the distorted one (see undistort.h), on the host and on a GPU: whole
// numbers throughout, so both give the same bytes. Rows of images are `pitch` values apart.

#include <stddef.h>
#include <stdint.h>

#include "base/formula.h"

namespace photoslam {

/// Position in the distorted image: the upper left of four neighbours and the way to the others in 1/256 pixel.
struct alignas(8) Tap {
  static constexpr uint16_t kNowhere = 0xffff;  ///< As `x`: the lens did not see it.

  uint16_t x = kNowhere, y = 0;
  uint16_t fx = 0, fy = 0;  ///< 0…256
};

/// Bilinear; black where the lens did not see.
template <int kChannels>
PHOTOSLAM_FORMULA void sample_color(const uint8_t* distorted, size_t pitch, Tap tap, uint8_t* pixel) {
  if (tap.x == Tap::kNowhere) {
    for (int c = 0; c < kChannels; ++c) pixel[c] = 0;
    return;
  }
  const uint8_t* const above = distorted + tap.y * pitch + static_cast<size_t>(tap.x) * kChannels;
  const uint8_t* const below = above + pitch;
  const uint32_t left = 256u - tap.fx, right = tap.fx, up = 256u - tap.fy, down = tap.fy;
  for (int c = 0; c < kChannels; ++c) {
    const uint32_t sum =
        up * (left * above[c] + right * above[c + kChannels]) + down * (left * below[c] + right * below[c + kChannels]);
    pixel[c] = static_cast<uint8_t>((sum + (1u << 15)) >> 16);
  }
}

/// The nearest of the neighbours, because depths of two surfaces must not be mixed; 0 where the lens did not see.
PHOTOSLAM_FORMULA uint16_t sample_depth(const uint16_t* distorted, size_t pitch, Tap tap) {
  if (tap.x == Tap::kNowhere) return 0;
  const size_t x = static_cast<size_t>(tap.x) + (tap.fx >= 128 ? 1 : 0);
  const size_t y = static_cast<size_t>(tap.y) + (tap.fy >= 128 ? 1 : 0);
  return distorted[y * pitch + x];
}

}  // namespace photoslam
