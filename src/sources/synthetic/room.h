// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/synthetic/world.h"

namespace photoslam {

/// A furnished living room.
///
/// World axes: x along the room, y across, z up, in metres; the room is the box from the origin to size().
class SyntheticRoom final : public SyntheticWorld {
 public:
  SyntheticRoom(uint64_t seed, Executor& executor, SceneQuality quality = SceneQuality::full);

  static Vec3 size() { return {5.2, 4.2, 2.6}; }

  std::unique_ptr<const CameraPath> path(uint64_t seed, double seconds_per_lap) const override;
};

}  // namespace photoslam
