// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "image/image.h"

/// Coding and decoding in memory, behind image_file.h. Errors do not name a file; the caller does.
namespace photoslam::internal {

struct ImageSize {
  size_t width = 0, height = 0;
};

/// Refuses sizes that no camera has, so that a damaged header cannot ask for all memory.
Status check_size(const ImageSize& size);

bool looks_like_png(std::string_view content);
bool looks_like_jpeg(std::string_view content);

/// 8-bit RGB or grey; palettes are expanded, 16 bits cut to 8, transparency dropped.
Result<ImageU8> decode_png(std::string_view content);
/// Only 16-bit single-channel files.
Result<ImageU16> decode_png16(std::string_view content);
Result<std::string> encode_png(const ImageU8& image, int compression);
Result<std::string> encode_png(const ImageU16& image, int compression);

Result<ImageU8> decode_jpeg(std::string_view content);
Result<std::string> encode_jpeg(const ImageU8& image, int quality);

}  // namespace photoslam::internal
