// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image_size.h"

#include <charconv>

namespace photoslam {

Result<ImageSize> parse_image_size(const std::string& text) {
  ImageSize size;
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  if (width.ec != std::errc{} || width.ptr == end || *width.ptr != 'x') return error("--size {}: expected WxH", text);
  const auto height = std::from_chars(width.ptr + 1, end, size.height);
  if (height.ec != std::errc{} || height.ptr != end || size.width < 1 || size.height < 1) {
    return error("--size {}: expected WxH, as in 480x640", text);
  }
  return size;
}

}  // namespace photoslam
