// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/pyramid.h"

#include "image/block_formulas.h"

namespace photoslam {
namespace {

/// Makes every pixel of the smaller image by pixel(block, pitch, factor) of a block of the larger one.
template <class T, class Pixel>
Image<T> shrink_blocks(const Image<T>& image, int factor, Pixel&& pixel) {
  PHOTOSLAM_CHECK(factor >= 1, "{}", factor);
  const int channels = image.channels();
  const auto pitch = static_cast<size_t>(image.width() * channels);
  Image<T> result(image.width() / factor, image.height() / factor, channels);
  for (int y = 0; y < result.height(); ++y) {
    T* target = result.row(y);
    for (int x = 0; x < result.width(); ++x) {
      for (int c = 0; c < channels; ++c) {
        *target++ = pixel(&image(x * factor, y * factor, c), pitch, static_cast<size_t>(factor));
      }
    }
  }
  return result;
}

template <class T>
Image<T> block_means(const Image<T>& image, int factor) {
  const auto step = static_cast<size_t>(image.channels());
  return shrink_blocks(image, factor, [step](const T* block, size_t pitch, size_t size) {
    return block_mean(block, step, pitch, size);
  });
}

}  // namespace

ImageU8 shrink_color(const ImageU8& color, int factor) { return factor == 1 ? color : block_means(color, factor); }
ImageF shrink_color(const ImageF& color, int factor) { return factor == 1 ? color : block_means(color, factor); }

ImageU16 shrink_depth(const ImageU16& depth, int factor) {
  PHOTOSLAM_CHECK(depth.channels() == 1, "{} channels", depth.channels());
  return shrink_blocks(depth, factor, block_median);
}

ImageU8 shrink_mask(const ImageU8& mask, int factor) {
  PHOTOSLAM_CHECK(mask.channels() == 1, "{} channels", mask.channels());
  return shrink_blocks(mask, factor, [](const uint8_t* block, size_t pitch, size_t size) -> uint8_t {
    return block_has_data(block, pitch, size) ? 255 : 0;
  });
}

CameraView shrink(const CameraView& view, int factor) {
  CameraView result{
      .camera = shrink(view.camera, factor), .color = shrink_color(view.color, factor), .depth = {}, .mask = {}};
  if (!view.depth.empty()) result.depth = shrink_depth(view.depth, factor);
  if (!view.mask.empty()) result.mask = shrink_mask(view.mask, factor);
  return result;
}

}  // namespace photoslam
