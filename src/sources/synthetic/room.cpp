// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/room.h"

#include "sources/synthetic/furniture/furniture.h"
#include "sources/synthetic/room_trajectory.h"

namespace photoslam {

SyntheticRoom::SyntheticRoom(uint64_t seed, Executor& executor, SceneQuality quality)
    : SyntheticWorld(synthetic::furnish_room(seed, size(), quality, executor), quality, executor) {}

std::unique_ptr<const CameraPath> SyntheticRoom::path(uint64_t seed, double seconds_per_lap) const {
  return std::make_unique<RoomTrajectory>(seed, seconds_per_lap);
}

}  // namespace photoslam
