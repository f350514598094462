// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

#include "base/random.h"
#include "features/grey_view.h"
#include "image/image.h"

namespace photoslam {

/// A scene of overlapping shaded rectangles, rich in corners, that can be sampled at any real position.
class RectangleScene {
 public:
  RectangleScene(int width, int height, int count, uint64_t seed) {
    Random random(seed);
    for (int i = 0; i < count; ++i) {
      const double angle = random.uniform(0, 3.14), size = random.uniform(6, 40), wave = random.uniform(0, 6.28);
      rectangles_.push_back({random.uniform(0, width), random.uniform(0, height), std::cos(angle), std::sin(angle),
                             size, size * random.uniform(0.4, 1), random.uniform(30, 225), 0.5 * std::cos(wave),
                             0.5 * std::sin(wave)});
    }
  }

  /// Grey level at a point: that of the topmost rectangle, which is the last one.
  double operator()(double x, double y) const {
    for (auto r = rectangles_.rbegin(); r != rectangles_.rend(); ++r) {
      const double dx = x - r->x, dy = y - r->y;
      if (std::abs(r->c * dx + r->s * dy) < r->half_width && std::abs(r->c * dy - r->s * dx) < r->half_height) {
        return r->grey + 20 * std::sin(r->wave_x * dx + r->wave_y * dy);
      }
    }
    return 128;
  }

  /// An image of the scene seen through scene_from_image, blurred a little like by a lens: 3x3 samples
  /// over two pixels.
  ImageU8 render(int width, int height, const std::function<void(double& x, double& y)>& scene_from_image) const {
    ImageU8 image(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int i = 0; i < 9; ++i) {
          const int u = i % 3 - 1, v = i / 3 - 1;
          double sx = x + u * 0.67, sy = y + v * 0.67;
          scene_from_image(sx, sy);
          sum += (*this)(sx, sy);
        }
        image(x, y) = static_cast<uint8_t>(std::lround(sum / 9));
      }
    }
    return image;
  }

 private:
  struct Rectangle {
    double x, y, c, s, half_width, half_height, grey, wave_x, wave_y;
  };
  std::vector<Rectangle> rectangles_;
};

inline ImageU8 random_image(int width, int height, uint64_t seed) {
  Random random(seed);
  ImageU8 image(width, height);
  for (uint8_t& v : image.values()) v = static_cast<uint8_t>(random.index(256));
  return image;
}

/// A padded copy of an image, as the kernels want it.
struct PaddedImage {
  explicit PaddedImage(const ImageU8& image)
      : width(image.width()), height(image.height()), stride(width + kRowPadding) {
    pixels.resize(static_cast<size_t>(stride * height), 0);
    for (int y = 0; y < height; ++y)
      std::memcpy(&pixels[static_cast<size_t>(y * stride)], image.row(y), static_cast<size_t>(width));
  }
  MutableGreyView view() { return {pixels.data(), width, height, stride}; }
  int width, height;
  ptrdiff_t stride;
  std::vector<uint8_t> pixels;
};

}  // namespace photoslam
