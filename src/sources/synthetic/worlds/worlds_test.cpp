// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/worlds/worlds.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "sources/synthetic/detail.h"
#include "sources/synthetic/sensor_model.h"

namespace photoslam {
namespace {

struct Lap {
  double length_m = 0, fastest = 0, fastest_turn = 0;  // m, m/s, rad/s
  double gap_m = 0;                                    // between start and end
};

Lap measure(const synthetic::Tour& tour) {
  const Walk walk(1, tour.waypoints, 1 / tour.lap_seconds, static_cast<int>(tour.waypoints.size()));
  constexpr double kStep = 0.05;
  Lap lap;
  SE3 before = walk.world_from_camera(0);
  for (double t = kStep; t <= tour.lap_seconds; t += kStep) {
    const SE3 now = walk.world_from_camera(t);
    const Vec6 motion = (before.inverse() * now).log();
    lap.length_m += motion.head<3>().norm();
    lap.fastest = std::max(lap.fastest, motion.head<3>().norm() / kStep);
    lap.fastest_turn = std::max(lap.fastest_turn, motion.tail<3>().norm() / kStep);
    before = now;
  }
  lap.gap_m = (before.translation - walk.world_from_camera(0).translation).norm();
  return lap;
}

TEST(SyntheticWorlds, ToursAreLoopsAtWalkingPace) {
  const Lap corridors = measure(synthetic::corridors_tour());
  EXPECT_GE(corridors.length_m, 60);
  EXPECT_GE(measure(synthetic::doors_tour()).length_m, 55);
  for (const synthetic::Tour& tour :
       {synthetic::house_tour(), synthetic::corridors_tour(), synthetic::doors_tour(), synthetic::courtyard_tour()}) {
    const Lap lap = measure(tour);
    EXPECT_LT(lap.gap_m, 0.15);
    EXPECT_LT(lap.fastest, 1.3);
    EXPECT_LT(lap.fastest_turn, 1.5);
  }
}

TEST(SyntheticWorlds, CanBeWalkedThroughAndLookAtDetail) {
  ThreadPool pool(2);
  const PinholeCamera camera{.width = 128, .height = 96, .fx = 105, .fy = 105, .cx = 63.5, .cy = 47.5};
  for (const WorldInfo& info : synthetic_worlds()) {
    if (info.name == "room") continue;  // has tests of its own
    const auto world = make_world(info.name, 1, pool, SceneQuality::draft);
    const auto path = world->path(1, 10);
    int without_depth = 0;
    for (double t = 0; t < 48; t += 4) {
      const SceneView view = world->render(path->world_from_camera(t), camera, pool);
      float nearest = 1e9f;
      for (const float depth : view.depth.values()) {
        if (depth > 0) nearest = std::min(nearest, depth);
        without_depth += depth > 0 ? 0 : 1;
      }
      EXPECT_GT(nearest, 0.3f) << info.name << " at " << t << " s: the camera runs into something";
      EXPECT_GT(measure_detail(expose(view, 0, 0, 0)).horizontal_difference, 1.5) << info.name << " at " << t << " s";
    }
    // Only the courtyard has a sky.
    EXPECT_EQ(without_depth > 0, info.name == "courtyard") << info.name;
  }
}

}  // namespace
}  // namespace photoslam
