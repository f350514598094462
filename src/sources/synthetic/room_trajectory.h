// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/synthetic/camera_path.h"

namespace photoslam {

/// A walk through the synthetic room.
///
/// The first lap pans over half of the room and comes back to where it began; the two laps after it show the rest; then
/// the tour starts over. With seconds_per_lap ≥ 10 the camera moves at most 0.6 m/s and turns at most 50°/s.
class RoomTrajectory final : public Walk {
 public:
  RoomTrajectory(uint64_t seed, double seconds_per_lap);
};

}  // namespace photoslam
