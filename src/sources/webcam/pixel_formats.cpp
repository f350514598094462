// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/webcam/pixel_formats.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "io/image_codec.h"

namespace photoslam::internal {

Result<ImageU8> yuyv_to_rgb(std::span<const uint8_t> bytes, int width, int height, int stride) {
  const auto row_bytes = static_cast<size_t>(stride);
  if (stride < 2 * width || width % 2 != 0 || bytes.size() < row_bytes * static_cast<size_t>(height)) {
    return error("a frame of {} bytes; {}x{} pixels of YUYV need {}", bytes.size(), width, height,
                 row_bytes * static_cast<size_t>(height));
  }
  const auto level = [](float value) { return static_cast<uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); };
  ImageU8 image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    const uint8_t* in = bytes.data() + static_cast<size_t>(y) * row_bytes;
    uint8_t* out = image.row(y);
    for (int x = 0; x < width; x += 2, in += 4) {
      const float u = static_cast<float>(in[1]) - 128, v = static_cast<float>(in[3]) - 128;
      for (const int luma : {in[0], in[2]}) {
        const float grey = 1.164384f * static_cast<float>(luma - 16);
        *out++ = level(grey + 1.596027f * v);
        *out++ = level(grey - 0.391762f * u - 0.812968f * v);
        *out++ = level(grey + 2.017232f * u);
      }
    }
  }
  return image;
}

Result<ImageU8> decode_mjpeg(std::span<const uint8_t> bytes) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as text
  const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!looks_like_jpeg(content)) return error("a frame that is no JPEG image");
  return decode_jpeg(content);
}

}  // namespace photoslam::internal
