// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/convert.h"

#include <cmath>

namespace photoslam {

ImageU8 to_grey(const ImageU8& image) {
  if (image.channels() == 1) return image;
  PHOTOSLAM_CHECK(image.channels() == 3, "{} channels", image.channels());
  // Weights in 1/2^16; they sum to 2^16, so that white stays white.
  constexpr uint32_t kRed = 19595, kGreen = 38470, kBlue = 7471, kHalf = 1 << 15;
  ImageU8 grey(image.width(), image.height());
  const uint8_t* rgb = image.values().data();
  for (uint8_t& value : grey.values()) {
    value = static_cast<uint8_t>((kRed * rgb[0] + kGreen * rgb[1] + kBlue * rgb[2] + kHalf) >> 16);
    rgb += 3;
  }
  return grey;
}

ImageU8 to_rgb(const ImageU8& image) {
  if (image.channels() == 3) return image;
  PHOTOSLAM_CHECK(image.channels() == 1, "{} channels", image.channels());
  ImageU8 rgb(image.width(), image.height(), 3);
  uint8_t* target = rgb.values().data();
  for (const uint8_t value : image.values()) {
    target[0] = target[1] = target[2] = value;
    target += 3;
  }
  return rgb;
}

ImageF to_float(const ImageU8& image) {
  ImageF result(image.width(), image.height(), image.channels());
  const auto source = image.values();
  const auto target = result.values();
  for (size_t i = 0; i < source.size(); ++i) target[i] = static_cast<float>(source[i]) * (1.0f / 255.0f);
  return result;
}

ImageU8 to_u8(const ImageF& image) {
  ImageU8 result(image.width(), image.height(), image.channels());
  const auto source = image.values();
  const auto target = result.values();
  for (size_t i = 0; i < source.size(); ++i) {
    const float level = source[i] * 255.0f + 0.5f;
    // Written so that NaN takes the branch to 0.
    target[i] = level >= 0.5f ? static_cast<uint8_t>(level < 255.0f ? level : 255.0f) : uint8_t{0};
  }
  return result;
}

}  // namespace photoslam
