// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <map>
#include <memory>

#include "localization/testing/ideal_mapper.h"
#include "localization/tracker.h"

namespace photoslam {
namespace {

using testing::IdealMapper;
using testing::PointWorld;

/// A mapped walk of `num_keyframes` keyframes through a world whose corners look a little different each time.
struct Walk {
  explicit Walk(int num_keyframes) : world(1, 8000), mapper(world) {
    world.pixel_noise = 0.7;
    world.flipped_bits = 0.06;
    for (int i = 0; i < num_keyframes; ++i) {
      const SE3 pose = PointWorld::camera_from_world(0.25 * i);
      const auto frame = world.observe(pose, i);
      mapper.add(KeyframeId(i), frame, pose, world.point_of_keypoint);
    }
    map = mapper.snapshot();
  }
  PointWorld world;
  IdealMapper mapper;
  std::shared_ptr<const MapSnapshot> map;
};

/// Made once: mapping takes longer than anything that is measured.
Walk& walk_of(int num_keyframes) {
  static std::map<int, std::unique_ptr<Walk>> walks;
  auto& walk = walks[num_keyframes];
  if (!walk) walk = std::make_unique<Walk>(num_keyframes);
  return *walk;
}

/// One frame from features to pose: last frame, local map, both refinements.
void track(benchmark::State& state) {
  Walk& walk = walk_of(static_cast<int>(state.range(0)));
  std::vector<std::shared_ptr<const FeatureFrame>> frames;
  for (int i = 0; i < 200; ++i) frames.push_back(walk.world.observe(PointWorld::camera_from_world(i / 30.0), i));
  Tracker tracker({}, {}, walk.world.camera, walk.world.bf);
  tracker.track(frames[0], nullptr, true);
  size_t next = 1;
  int tracked = 0, inliers = 0, runs = 0;
  for (auto _ : state) {
    const TrackingResult result = tracker.track(frames[next], walk.map, false);
    // Back and forth, so that the motion stays smooth but at the ends.
    next = runs / 198 % 2 == 0 ? next + 1 : next - 1;
    ++runs;
    tracked += result.has_pose ? 1 : 0;
    inliers += result.num_inliers;
  }
  state.counters["keypoints"] = static_cast<double>(frames[0]->size());
  state.counters["inliers"] = inliers / static_cast<double>(std::max(tracked, 1));
  state.counters["tracked"] = tracked / static_cast<double>(runs);
}
BENCHMARK(track)->Arg(40)->Arg(160)->Unit(benchmark::kMillisecond);

void relocalize(benchmark::State& state) {
  Walk& walk = walk_of(static_cast<int>(state.range(0)));
  Relocalizer relocalizer({}, FrameAlignment({}, {}, walk.world.camera, walk.world.bf));
  relocalizer.update(*walk.map);
  std::vector<std::shared_ptr<const FeatureFrame>> frames;
  for (int i = 0; i < 50; ++i) frames.push_back(walk.world.observe(PointWorld::camera_from_world(0.2 * i), i));
  size_t next = 0;
  int found = 0, runs = 0;
  for (auto _ : state) {
    found += relocalizer.relocalize(*walk.map, *frames[next++ % frames.size()], KeyframeId{}).has_value() ? 1 : 0;
    ++runs;
  }
  state.counters["found"] = found / static_cast<double>(runs);
}
BENCHMARK(relocalize)->Arg(40)->Arg(160)->Unit(benchmark::kMillisecond);

/// No candidate fits: the most that a lost frame costs.
void relocalize_in_vain(benchmark::State& state) {
  Walk& walk = walk_of(static_cast<int>(state.range(0)));
  Relocalizer relocalizer({}, FrameAlignment({}, {}, walk.world.camera, walk.world.bf));
  relocalizer.update(*walk.map);
  PointWorld other(2, 8000);
  other.descriptors = walk.world.descriptors;
  const auto frame = other.observe(SE3{}, 0);
  for (auto _ : state) benchmark::DoNotOptimize(relocalizer.relocalize(*walk.map, *frame, KeyframeId(3)));
}
BENCHMARK(relocalize_in_vain)->Arg(160)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace photoslam
