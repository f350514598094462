// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "image/image.h"

namespace photoslam::internal {

/// Packed YUYV (4:2:2, BT.601, video range) as webcams send it, to RGB. `stride` is the bytes of a row.
Result<ImageU8> yuyv_to_rgb(std::span<const uint8_t> bytes, int width, int height, int stride);

/// One frame of motion JPEG; Huffman tables may be missing, as UVC allows.
Result<ImageU8> decode_mjpeg(std::span<const uint8_t> bytes);

}  // namespace photoslam::internal
