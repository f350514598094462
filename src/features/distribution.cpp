// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/distribution.h"

#include <algorithm>
#include <cmath>

namespace photoslam {
namespace {

bool stronger(const Corner& a, const Corner& b) { return a.score > b.score; }

}  // namespace

void CornerDistributor::choose(const std::vector<Corner>& corners, int width, int height, int count,
                               int strong_threshold, std::vector<Corner>& chosen) {
  chosen.clear();
  if (count <= 0 || corners.empty()) return;
  const double area = static_cast<double>(width) * height;
  const int cell_size = std::max(1, static_cast<int>(std::lround(std::sqrt(area / count))));
  const int columns = (width + cell_size - 1) / cell_size, rows = (height + cell_size - 1) / cell_size;
  cells_.assign(static_cast<size_t>(columns) * static_cast<size_t>(rows), Cell());
  for (const Corner& corner : corners) {
    Cell& cell = cells_[static_cast<size_t>(corner.y / cell_size * columns + corner.x / cell_size)];
    if (cell.count == kMaxPerCell && !stronger(corner, cell.best[kMaxPerCell - 1])) continue;
    int place = std::min(cell.count, kMaxPerCell - 1);
    for (; place > 0 && stronger(corner, cell.best[place - 1]); --place) cell.best[place] = cell.best[place - 1];
    cell.best[place] = corner;
    cell.count = std::min(cell.count + 1, kMaxPerCell);
  }

  for (int rank = 0; rank < kMaxPerCell && static_cast<int>(chosen.size()) < count; ++rank) {
    const auto first = static_cast<ptrdiff_t>(chosen.size());
    for (const Cell& cell : cells_) {
      if (rank >= cell.count) continue;
      const bool weak = cell.best[rank].score <= strong_threshold && cell.best[0].score > strong_threshold;
      if (!weak) chosen.push_back(cell.best[rank]);
    }
    if (static_cast<int>(chosen.size()) > count) {
      std::stable_sort(chosen.begin() + first, chosen.end(), stronger);
      chosen.resize(static_cast<size_t>(count));
    }
  }
}

}  // namespace photoslam
