// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// How a block of factor x factor values becomes one pixel of a smaller image (see pyramid.h), on the host and on a GPU.
// A block begins at `first`; its rows are `pitch` values apart.

#include <stddef.h>
#include <stdint.h>

#include <type_traits>

#include "base/formula.h"

namespace photoslam {

/// The mean of values `step` apart; integers are rounded to the nearest.
template <class T>
PHOTOSLAM_FORMULA T block_mean(const T* first, size_t step, size_t pitch, size_t factor) {
  using Sum = std::conditional_t<std::is_integral_v<T>, uint32_t, float>;
  Sum sum = 0;
  for (size_t y = 0; y < factor; ++y)
    for (size_t x = 0; x < factor; ++x) sum += static_cast<Sum>(first[y * pitch + x * step]);
  const auto area = static_cast<Sum>(factor * factor);
  if constexpr (std::is_integral_v<T>) sum += area / 2;
  return static_cast<T>(sum / area);
}

/// Whether all values of a mask are set.
PHOTOSLAM_FORMULA bool block_has_data(const uint8_t* first, size_t pitch, size_t factor) {
  for (size_t y = 0; y < factor; ++y)
    for (size_t x = 0; x < factor; ++x)
      if (first[y * pitch + x] == 0) return false;
  return true;
}

/// The lower median of what is measured (not 0); 0 where less than half of the block is.
PHOTOSLAM_FORMULA uint16_t block_median(const uint16_t* first, size_t pitch, size_t factor) {
  uint32_t count = 0, low = 0xffff, high = 0;
  for (size_t y = 0; y < factor; ++y)
    for (size_t x = 0; x < factor; ++x) {
      const uint32_t value = first[y * pitch + x];
      if (value == 0) continue;
      ++count;
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
  if (2 * count < factor * factor) return 0;
  // The smallest value that half of them do not exceed. Nothing is sorted or stored, as suits a GPU.
  while (low < high) {
    const uint32_t middle = (low + high) / 2;
    uint32_t below = 0;
    for (size_t y = 0; y < factor; ++y)
      for (size_t x = 0; x < factor; ++x) {
        const uint32_t value = first[y * pitch + x];
        below += value != 0 && value <= middle ? 1 : 0;
      }
    if (2 * below >= count)
      high = middle;
    else
      low = middle + 1;
  }
  return static_cast<uint16_t>(low);
}

}  // namespace photoslam
