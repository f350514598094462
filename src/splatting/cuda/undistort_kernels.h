// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/undistort_formulas.h"
#include "splatting/cuda/group.h"

namespace photoslam::splatting::cuda {

/// One thread per pixel of the target.
struct UndistortColor {
  static constexpr int kThreads = 256;
  using Shared = NoShared;
  const Tap* taps;
  size_t pixels;
  int channels;              ///< 1 or 3
  const uint8_t* distorted;  ///< [H, W, channels]
  size_t width;              ///< Of `distorted`.
  uint8_t* target;           ///< [pixels, channels]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const size_t i = static_cast<size_t>(group.block()) * kThreads + static_cast<size_t>(group.thread());
    if (i >= pixels) return;
    if (channels == 3)
      sample_color<3>(distorted, 3 * width, taps[i], target + 3 * i);
    else
      sample_color<1>(distorted, width, taps[i], target + i);
  }
};

/// One thread per pixel of the target.
struct UndistortDepth {
  static constexpr int kThreads = 256;
  using Shared = NoShared;
  const Tap* taps;
  size_t pixels;
  const uint16_t* distorted;  ///< [H, W]
  size_t width;               ///< Of `distorted`.
  uint16_t* target;           ///< [pixels]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const size_t i = static_cast<size_t>(group.block()) * kThreads + static_cast<size_t>(group.thread());
    if (i < pixels) target[i] = sample_depth(distorted, width, taps[i]);
  }
};

}  // namespace photoslam::splatting::cuda
