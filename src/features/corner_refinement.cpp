// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/corner_refinement.h"

#include <algorithm>
#include <cstdint>

#include "features/fast.h"

namespace photoslam {

CornerPosition refine_corner(const GreyView& image, int x, int y) {
  uint8_t s[3][3 + kRowPadding];
  for (int row = 0; row < 3; ++row) fast_score_row(image, y + row - 1, x - 1, x + 2, 0, s[row]);
  // Least-squares fit of c + g·d + ½ d·H d over d in {-1, 0, 1}²; the integer sums are 6 g, 3 H_xx, 3 H_yy and 4 H_xy.
  const auto row_sum = [&s](int row) { return s[row][0] + s[row][1] + s[row][2]; };
  const auto column_sum = [&s](int column) { return s[0][column] + s[1][column] + s[2][column]; };
  const double gx = (column_sum(2) - column_sum(0)) / 6.0;
  const double gy = (row_sum(2) - row_sum(0)) / 6.0;
  const double hxx = (column_sum(0) - 2 * column_sum(1) + column_sum(2)) / 3.0;
  const double hyy = (row_sum(0) - 2 * row_sum(1) + row_sum(2)) / 3.0;
  const double hxy = (s[0][0] + s[2][2] - s[0][2] - s[2][0]) / 4.0;
  const double determinant = hxx * hyy - hxy * hxy;
  const CornerPosition pixel{static_cast<double>(x), static_cast<double>(y)};
  if (determinant <= 0 || hxx >= 0) return pixel;
  const double dx = (hxy * gy - hyy * gx) / determinant;
  const double dy = (hxy * gx - hxx * gy) / determinant;
  if (std::abs(dx) > 1 || std::abs(dy) > 1) return pixel;  // No maximum near the pixel.
  return {x + std::clamp(dx, -0.5, 0.5), y + std::clamp(dy, -0.5, 0.5)};
}

}  // namespace photoslam
