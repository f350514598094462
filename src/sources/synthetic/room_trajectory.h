// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "math/se3.h"

namespace photoslam {

/// A walk through the synthetic room with a hand-held camera.
///
/// Endless and smooth (twice differentiable). The first lap pans over half of the room and comes back to where it
/// began; the two laps after it show the rest; then the tour starts over, never with quite the same shake.
/// With seconds_per_lap ≥ 10 the camera moves at most 0.6 m/s and turns at most 50°/s.
class RoomTrajectory {
 public:
  RoomTrajectory(uint64_t seed, double seconds_per_lap);

  /// Pose at `seconds` ≥ 0 after the start.
  SE3 world_from_camera(double seconds) const;

 private:
  double laps_per_second_;
  std::vector<double> shake_phases_;
  std::vector<Vec3> positions_;  ///< Spline coefficients, one per knot of the tour.
  std::vector<Vec3> targets_;
};

}  // namespace photoslam
