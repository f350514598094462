// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/pyramid.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "math/median.h"

namespace photoslam {
namespace {

/// Means of factor x factor blocks, channel by channel; integers are rounded to the nearest.
template <class T>
Image<T> block_means(const Image<T>& image, int factor) {
  PHOTOSLAM_CHECK(factor >= 1, "{}", factor);
  using Sum = std::conditional_t<std::is_integral_v<T>, uint32_t, float>;
  const int channels = image.channels();
  Image<T> result(image.width() / factor, image.height() / factor, channels);
  const auto row_values = static_cast<size_t>(result.width() * channels);
  const auto area = static_cast<Sum>(factor * factor);
  std::vector<Sum> sums(row_values);
  for (int y = 0; y < result.height(); ++y) {
    std::ranges::fill(sums, Sum{0});
    for (int dy = 0; dy < factor; ++dy) {
      const T* source = image.row(y * factor + dy);
      for (int x = 0; x < result.width(); ++x) {
        Sum* const sum = &sums[static_cast<size_t>(x * channels)];
        for (int dx = 0; dx < factor; ++dx) {
          for (int c = 0; c < channels; ++c) sum[c] += static_cast<Sum>(*source++);
        }
      }
    }
    T* const target = result.row(y);
    for (size_t i = 0; i < row_values; ++i) {
      if constexpr (std::is_integral_v<T>) {
        target[i] = static_cast<T>((sums[i] + area / 2) / area);
      } else {
        target[i] = sums[i] / area;
      }
    }
  }
  return result;
}

}  // namespace

ImageU8 shrink_color(const ImageU8& color, int factor) { return factor == 1 ? color : block_means(color, factor); }
ImageF shrink_color(const ImageF& color, int factor) { return factor == 1 ? color : block_means(color, factor); }

ImageU16 shrink_depth(const ImageU16& depth, int factor) {
  PHOTOSLAM_CHECK(factor >= 1 && depth.channels() == 1, "factor {}, {} channels", factor, depth.channels());
  ImageU16 result(depth.width() / factor, depth.height() / factor);
  std::vector<uint16_t> block;
  for (int y = 0; y < result.height(); ++y) {
    for (int x = 0; x < result.width(); ++x) {
      block.clear();
      for (int dy = 0; dy < factor; ++dy) {
        const uint16_t* const source = depth.row(y * factor + dy) + x * factor;
        std::copy_if(source, source + factor, std::back_inserter(block), [](uint16_t d) { return d != 0; });
      }
      if (2 * static_cast<int>(block.size()) < factor * factor) continue;
      result(x, y) = lower_median(block);
    }
  }
  return result;
}

ImageU8 shrink_mask(const ImageU8& mask, int factor) {
  PHOTOSLAM_CHECK(factor >= 1 && mask.channels() == 1, "factor {}, {} channels", factor, mask.channels());
  ImageU8 result(mask.width() / factor, mask.height() / factor, 1, 255);
  for (int y = 0; y < result.height() * factor; ++y) {
    const uint8_t* const source = mask.row(y);
    uint8_t* const target = result.row(y / factor);
    for (int x = 0; x < result.width() * factor; ++x) {
      if (source[x] == 0) target[x / factor] = 0;
    }
  }
  return result;
}

CameraView shrink(const CameraView& view, int factor) {
  CameraView result{
      .camera = shrink(view.camera, factor), .color = shrink_color(view.color, factor), .depth = {}, .mask = {}};
  if (!view.depth.empty()) result.depth = shrink_depth(view.depth, factor);
  if (!view.mask.empty()) result.mask = shrink_mask(view.mask, factor);
  return result;
}

}  // namespace photoslam
