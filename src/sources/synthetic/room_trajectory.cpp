// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/room_trajectory.h"

namespace photoslam {
namespace {

constexpr int kKnotsPerLap = 10;

/// The tour: one waypoint per tenth of a lap. The first lap and the whole tour end where they began.
const std::vector<Waypoint>& tour() {
  static const std::vector<Waypoint> waypoints = {
      // First lap: desk, shelf, rug and sofa, and back over the desk to the sideboard.
      {{3.45, 1.20, 1.50}, {2.30, 3.90, 0.85}},
      {{3.15, 1.02, 1.47}, {1.60, 3.70, 0.85}},
      {{2.80, 0.95, 1.44}, {1.00, 3.20, 0.75}},
      {{2.55, 1.02, 1.41}, {0.60, 2.30, 0.60}},
      {{2.60, 1.30, 1.40}, {0.50, 1.90, 0.60}},
      {{2.85, 1.65, 1.42}, {0.90, 3.00, 0.70}},
      {{3.05, 1.95, 1.44}, {1.50, 3.90, 0.90}},
      {{3.20, 2.10, 1.46}, {2.70, 4.00, 0.95}},
      {{3.41, 1.93, 1.48}, {3.90, 4.00, 0.90}},
      {{3.52, 1.57, 1.50}, {3.30, 4.00, 0.85}},
      // Second lap: sideboard, window, armchair, the pictures on the south wall, stove, cupboard.
      {{3.45, 1.20, 1.50}, {2.30, 3.90, 0.85}},
      {{3.33, 1.55, 1.50}, {3.62, 3.90, 0.85}},
      {{3.13, 2.00, 1.48}, {4.65, 3.60, 0.80}},
      {{2.86, 2.40, 1.46}, {5.00, 2.50, 0.85}},
      {{2.71, 2.70, 1.45}, {4.70, 1.20, 0.75}},
      {{2.68, 2.88, 1.45}, {3.60, 0.30, 0.85}},
      {{2.75, 2.92, 1.46}, {2.70, 0.30, 0.95}},
      {{2.86, 2.84, 1.47}, {1.90, 0.30, 0.95}},
      {{3.00, 2.68, 1.48}, {1.10, 0.60, 0.90}},
      {{3.12, 2.44, 1.48}, {0.50, 1.20, 0.75}},
      // Third lap: sofa, round the coffee table, shelf.
      {{3.15, 2.15, 1.47}, {0.60, 1.90, 0.60}},
      {{3.08, 1.85, 1.44}, {1.20, 1.80, 0.50}},
      {{2.95, 1.48, 1.40}, {1.60, 1.75, 0.45}},
      {{2.70, 1.08, 1.38}, {1.70, 1.90, 0.45}},
      {{2.36, 0.88, 1.38}, {1.85, 2.30, 0.50}},
      {{2.15, 0.95, 1.40}, {1.60, 3.40, 0.75}},
      {{2.32, 1.08, 1.43}, {0.90, 3.80, 0.95}},
      {{2.65, 1.06, 1.46}, {1.30, 3.90, 1.05}},
      {{3.00, 1.04, 1.48}, {2.20, 4.00, 1.00}},
      {{3.28, 1.08, 1.49}, {2.55, 4.00, 0.95}},
  };
  return waypoints;
}

}  // namespace

RoomTrajectory::RoomTrajectory(uint64_t seed, double seconds_per_lap)
    : Walk(seed, tour(), 1 / seconds_per_lap, kKnotsPerLap) {}

}  // namespace photoslam
