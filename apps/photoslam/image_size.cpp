// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image_size.h"

#include <CLI/CLI.hpp>
#include <charconv>

namespace photoslam {

ImageSize parse_image_size(const std::string& text) {
  ImageSize size;
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  bool is_size = width.ec == std::errc{} && width.ptr != end && *width.ptr == 'x';
  if (is_size) {
    const auto height = std::from_chars(width.ptr + 1, end, size.height);
    is_size = height.ec == std::errc{} && height.ptr == end && size.width >= 1 && size.height >= 1;
  }
  if (!is_size) throw CLI::ValidationError("--size", text + ": expected WxH, as in 480x640");
  return size;
}

}  // namespace photoslam
