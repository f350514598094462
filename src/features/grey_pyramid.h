// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "features/grey_view.h"
#include "image/image.h"

namespace photoslam {

/// A grey image at falling resolutions, each level 1 / scale_factor of the one before.
///
/// Pixel centres are integers, hence x_full = (x_level + ½) scale(level) − ½; exactly so for every level and axis,
/// since level sizes round down and what is left over at the right and at the bottom is not used.
class GreyPyramid {
 public:
  /// scale_factor in (1, 2].
  void build(const ImageU8& grey, int num_levels, double scale_factor);

  int num_levels() const { return static_cast<int>(levels_.size()); }
  GreyView level(int i) const { return levels_[static_cast<size_t>(i)]; }
  double scale(int i) const { return scales_[static_cast<size_t>(i)]; }

 private:
  std::vector<uint8_t> pixels_;
  std::vector<MutableGreyView> levels_;
  std::vector<double> scales_;
  std::vector<int32_t> columns_;  // Left one of the two source columns of every target column.
  std::vector<int32_t> weights_;  // Weights of the two, packed as two int16.
  std::vector<int16_t> blended_;  // One row of vertically blended pixels.
};

/// Gaussian blur, σ = 2 px over 7x7, borders replicated. Same size and stride; `scratch` is reused between calls.
void blur(const GreyView& source, const MutableGreyView& target, std::vector<uint8_t>& scratch);

}  // namespace photoslam
