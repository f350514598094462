// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/check.h"

namespace photoslam {

/// Row-major image with interleaved channels; copying copies the pixels.
template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, int channels = 1, T fill = T{})
      : width_(width), height_(height), channels_(channels), pixels_(count(width, height, channels), fill) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  bool empty() const { return pixels_.empty(); }
  bool same_size(const auto& other) const { return width_ == other.width() && height_ == other.height(); }

  T* row(int y) { return pixels_.data() + offset(y); }
  const T* row(int y) const { return pixels_.data() + offset(y); }
  T& operator()(int x, int y, int c = 0) { return row(y)[x * channels_ + c]; }
  const T& operator()(int x, int y, int c = 0) const { return row(y)[x * channels_ + c]; }

  /// All values, row by row.
  std::span<T> values() { return pixels_; }
  std::span<const T> values() const { return pixels_; }

  bool operator==(const Image&) const = default;

 private:
  static size_t count(int width, int height, int channels) {
    PHOTOSLAM_CHECK(width >= 0 && height >= 0 && channels >= 1, "{}x{}x{}", width, height, channels);
    return static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels);
  }
  size_t offset(int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) * static_cast<size_t>(channels_);
  }

  int width_ = 0;
  int height_ = 0;
  int channels_ = 1;
  std::vector<T> pixels_;
};

using ImageU8 = Image<uint8_t>;    ///< Grey (1 channel) or RGB (3 channels).
using ImageU16 = Image<uint16_t>;  ///< Depth; 0 means no measurement.
using ImageF = Image<float>;       ///< Grey or RGB in [0, 1], or any measured quantity.

}  // namespace photoslam
