// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/resize.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace photoslam {
namespace {

/// A source pixel and its share of a new pixel's extent along one axis.
struct Share {
  int source = 0;
  double weight = 0;
};

/// For each new pixel, the source pixels that it covers; weights sum to 1.
std::vector<std::vector<Share>> coverage(int old_size, int new_size) {
  const double scale = static_cast<double>(old_size) / new_size;
  std::vector<std::vector<Share>> result(static_cast<size_t>(new_size));
  for (int i = 0; i < new_size; ++i) {
    const double begin = i * scale, end = (i + 1) * scale;
    for (int s = static_cast<int>(begin); s < old_size && s < end; ++s) {
      const double overlap = std::min(end, s + 1.0) - std::max(begin, static_cast<double>(s));
      if (overlap > 1e-9) result[static_cast<size_t>(i)].push_back({s, overlap / scale});
    }
  }
  return result;
}

}  // namespace

ImageU8 resize(const ImageU8& image, int width, int height) {
  if (image.width() == width && image.height() == height) return image;
  const auto columns = coverage(image.width(), width), rows = coverage(image.height(), height);
  ImageU8 result(width, height, image.channels());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < image.channels(); ++c) {
        double sum = 0;
        for (const Share& row : rows[static_cast<size_t>(y)]) {
          for (const Share& column : columns[static_cast<size_t>(x)]) {
            sum += row.weight * column.weight * image(column.source, row.source, c);
          }
        }
        result(x, y, c) = static_cast<uint8_t>(std::lround(sum));
      }
    }
  }
  return result;
}

PinholeCamera resize(const PinholeCamera& camera, int width, int height) {
  const double sx = static_cast<double>(width) / camera.width, sy = static_cast<double>(height) / camera.height;
  return {width, height, sx * camera.fx, sy * camera.fy, (camera.cx + 0.5) * sx - 0.5, (camera.cy + 0.5) * sy - 0.5};
}

}  // namespace photoslam
