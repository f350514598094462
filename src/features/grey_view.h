// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace photoslam {

/// Bytes after the end of every row of a padded image that kernels may read and write (their content means nothing).
inline constexpr int kRowPadding = 64;

/// A grey image inside a padded buffer; does not own its pixels.
template <class Byte>
struct BasicGreyView {
  Byte* pixels = nullptr;
  int width = 0;
  int height = 0;
  ptrdiff_t stride = 0;  ///< Pixels from one row to the next, at least width + kRowPadding.

  Byte* row(int y) const { return pixels + y * stride; }
  Byte* at(int x, int y) const { return row(y) + x; }
  operator BasicGreyView<const uint8_t>() const {  // NOLINT(google-explicit-constructor): like span<T> to span<const T>
    return {pixels, width, height, stride};
  }
};

using GreyView = BasicGreyView<const uint8_t>;
using MutableGreyView = BasicGreyView<uint8_t>;

}  // namespace photoslam
