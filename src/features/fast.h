// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "features/grey_view.h"

namespace photoslam {

/// A corner at an integer pixel.
struct Corner {
  int16_t x = 0;
  int16_t y = 0;
  uint8_t score = 0;
};

/// FAST-9 corner score (Rosten & Drummond 2006) of the pixels in [left, right) of row y: the largest s such that nine
/// neighbouring pixels of the sixteen on the circle of radius 3 are all brighter, or all darker, than the centre by at
/// least s. Scores of at most `threshold` are written as 0. `scores` [right - left], padded like an image row.
///
/// Needs 3 <= left, right <= width - 3 and 3 <= y < height - 3.
void fast_score_row(const GreyView& image, int y, int left, int right, int threshold, uint8_t* scores);

/// Appends the corners at least `border` (>= 4) pixels inside the image with a score above `threshold` and not below
/// any of their eight neighbours (of equal neighbours the first), row by row. `scratch` is reused between calls.
void detect_fast(const GreyView& image, int border, int threshold, std::vector<uint8_t>& scratch,
                 std::vector<Corner>& corners);

}  // namespace photoslam
