// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "sources/synthetic/furniture/workshop.h"
#include "sources/synthetic/world.h"

/// The worlds beside the room. Each is a way to furnish and a way to walk.
namespace photoslam::synthetic {

/// A round of waypoints, all passed in `lap_seconds` at the usual pace.
struct Tour {
  std::vector<Waypoint> waypoints;
  double lap_seconds = 10;
};

SceneModel build_house(uint64_t seed, SceneQuality quality, Executor& executor);
SceneModel build_corridors(uint64_t seed, SceneQuality quality, Executor& executor);
SceneModel build_doors(uint64_t seed, SceneQuality quality, Executor& executor);
SceneModel build_courtyard(uint64_t seed, SceneQuality quality, Executor& executor);

Tour house_tour();      ///< 14 m through two rooms and both doorways between them.
Tour corridors_tour();  ///< 64 m round the square.
Tour doors_tour();      ///< 30 m there and 30 m back.
Tour courtyard_tour();  ///< 43 m round the court.

}  // namespace photoslam::synthetic
