// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/block_formulas.h"
#include "splatting/cuda/project_kernels.h"

namespace photoslam::splatting::cuda {

/// A target image in the device's memory.
struct TargetPlanes {
  uint8_t* rgb;     ///< [3, H, W]
  uint8_t* mask;    ///< [H, W]: 0 = no data; or null
  uint16_t* depth;  ///< [H, W]; or null
};

/// A target image at 1/factor of its resolution, as TargetImage::shrunk() makes it: one thread per pixel.
struct ShrinkKernel {
  static constexpr int kThreads = 256;
  using Shared = NoShared;
  TargetPlanes from;
  Extent size;  ///< Of `from`.
  int factor;
  TargetPlanes to;   ///< Mask and depth where `from` has them.
  uint32_t* counts;  ///< [2] Pixels with data and with depth: counts on from what they hold.

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const size_t width = static_cast<size_t>(size.width / factor);
    const size_t pixels = width * static_cast<size_t>(size.height / factor);
    const size_t i = static_cast<size_t>(group.block()) * kThreads + static_cast<size_t>(group.thread());
    bool has_data = false, has_depth = false;
    if (i < pixels) {
      const size_t pitch = static_cast<size_t>(size.width), block = static_cast<size_t>(factor);
      const size_t first = i / width * block * pitch + i % width * block;
      for (size_t c = 0; c < 3; ++c) {
        const size_t plane = c * pitch * static_cast<size_t>(size.height);
        to.rgb[c * pixels + i] = block_mean(from.rgb + plane + first, 1, pitch, block);
      }
      has_data = from.mask == nullptr || block_has_data(from.mask + first, pitch, block);
      if (to.mask != nullptr) to.mask[i] = has_data ? 255 : 0;
      if (to.depth != nullptr) {
        to.depth[i] = has_data ? block_median(from.depth + first, pitch, block) : 0;
        has_depth = to.depth[i] != 0;
      }
    }
    const uint32_t with_data = group.ballot(has_data), with_depth = group.ballot(has_depth);
    if (group.lane() != 0) return;
    if (with_data != 0) group.add(&counts[0], count_bits(with_data));
    if (with_depth != 0) group.add(&counts[1], count_bits(with_depth));
  }
};

}  // namespace photoslam::splatting::cuda
