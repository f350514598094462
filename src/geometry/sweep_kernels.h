// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace photoslam::internal {

// The inner loops of sweep_depth(), compiled for several SIMD targets and chosen at run time. The number of planes is a
// multiple of kPlaneLanes.
constexpr int kPlaneLanes = 16;
constexpr int kSignatureBits = 24;
constexpr int kSignatureRadius = 2;
constexpr int kCostScale = 4;  ///< Costs are small integers: differing bits times this.

/// A row of the reference picture on its way into a view: pixel x at inverse depth w appears at h = start + x step +
/// w offset, divided by its third coordinate.
struct SweepRow {
  const uint32_t* signatures = nullptr;  // of the view, [height, width]
  int width = 0, height = 0;
  float start[3] = {}, step[3] = {}, offset[3] = {};
};

/// cost[x, k]: how badly pixel x (of `count`, with signature reference[x]) matches on plane k, averaged over the views
/// that see it there; that of a coin toss where none does. [count, planes]
void match_row(const uint32_t* reference, int count, std::span<const float> inverse_depths,
               std::span<const SweepRow> views, int16_t* cost);

/// One step along a path, for all planes: path = cost + min(previous, previous of the neighbouring planes + small,
/// least of previous + large) − least; total += path. `previous` and `path` have a border of one on either side.
/// Returns the least of `path`.
int16_t follow_path(int planes, const int16_t* cost, const int16_t* previous, int16_t least, int16_t small_penalty,
                    int16_t large_penalty, int16_t* path, int16_t* total);

/// The first plane of least total. It is ambiguous when another, more than two planes away, costs less than `margin`
/// more.
struct BestPlane {
  int plane = 0;
  bool ambiguous = false;
};
BestPlane find_best_plane(int planes, const int16_t* total, int16_t margin);

}  // namespace photoslam::internal
