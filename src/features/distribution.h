// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "features/fast.h"

namespace photoslam {

/// Chooses corners that cover an image evenly: the image is divided into about as many square cells as corners are
/// wanted; first the best corner of every cell is taken, then the second best, and so on, strongest first. In a cell
/// that has a corner above the strong threshold the others do not count. Keeps its buffers between calls;
/// deterministic.
class CornerDistributor {
 public:
  /// Writes at most `count` of the corners of a width x height image to `chosen`, in the order of choice.
  void choose(const std::vector<Corner>& corners, int width, int height, int count, int strong_threshold,
              std::vector<Corner>& chosen);

 private:
  static constexpr int kMaxPerCell = 8;
  struct Cell {
    int count = 0;
    Corner best[kMaxPerCell];  // Strongest first; of equal ones the first in the input.
  };
  std::vector<Cell> cells_;
};

}  // namespace photoslam
