// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "loop_closure/loop_closer.h"

#include <gtest/gtest.h>

#include <set>

#include "base/archive.h"
#include "geometry_mapping/geometry_mapper.h"
#include "loop_closure/full_adjustment.h"
#include "map/testing/corridor_world.h"
#include "math/umeyama.h"

namespace photoslam {
namespace {

using testing::CorridorWorld;

OrbOptions orb() { return {}; }

/// A walk with drift, and what loop closure makes of its map.
struct Closing {
  CorridorWorld corridor;
  double bf;
  GeometryMapper geometry;
  LoopCloser closer;

  Closing(CorridorWorld c, bool with_depth, double scale_drift, uint64_t seed, double rotation_error = 0.002)
      : corridor(std::move(c)),
        bf(with_depth ? corridor.world.bf : 0),
        geometry({}, orb(), corridor.world.camera, bf),
        closer({}, orb(), corridor.world.camera, bf) {
    geometry.set_map(corridor.drifted_map(0.004, rotation_error, scale_drift, with_depth, seed));
  }

  void run() {
    auto map = geometry.snapshot();
    while (const auto correction = closer.process(*map)) map = geometry.correct(*correction);
  }

  /// Distance between where the last keyframe is and where it should be, seen from the first. Without depth the size of
  /// the world is free.
  double gap() const {
    const Map& map = geometry.map();
    const size_t last = corridor.truth.size() - 1;
    const auto relative = [](const SE3& first, const SE3& last_pose) { return last_pose * first.inverse(); };
    const SE3 estimate = relative(map.keyframe(KeyframeId(0)).camera_from_world,
                                  map.keyframe(KeyframeId(static_cast<int32_t>(last))).camera_from_world);
    const SE3 exact = relative(corridor.truth[0], corridor.truth[last]);
    return (alignment().scale * estimate.inverse().translation - exact.inverse().translation).norm();
  }

  std::pair<std::vector<Vec3>, std::vector<Vec3>> centres() const {
    std::vector<Vec3> estimate, exact;
    for (size_t k = 0; k < corridor.truth.size(); ++k) {
      estimate.push_back(
          geometry.map().keyframe(KeyframeId(static_cast<int32_t>(k))).camera_from_world.inverse().translation);
      exact.push_back(corridor.truth[k].inverse().translation);
    }
    return {estimate, exact};
  }

  Sim3 alignment() const {
    const auto [estimate, exact] = centres();
    return align_umeyama(estimate, exact, bf <= 0);
  }

  double ate() const {
    const auto [estimate, exact] = centres();
    const Sim3 fit = alignment();
    double sum = 0;
    for (size_t k = 0; k < exact.size(); ++k) sum += (fit * estimate[k] - exact[k]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(exact.size()));
  }
};

/// The open loop drifts, the closed one hardly.
void expect_closed(Closing& closing) {
  const double path = closing.corridor.path_length(), before = closing.gap();
  ASSERT_GT(before, 0.01 * path);
  closing.run();
  EXPECT_GE(closing.closer.num_closed(), 1);
  EXPECT_LT(closing.gap(), before / 5);
  EXPECT_LT(closing.ate(), 0.005 * path);
}

class LoopCloserSeeds : public ::testing::TestWithParam<uint64_t> {};
INSTANTIATE_TEST_SUITE_P(Ten, LoopCloserSeeds, ::testing::Range(uint64_t{1}, uint64_t{11}));

TEST_P(LoopCloserSeeds, ClosesTheSquareWithDepth) {
  Closing closing(CorridorWorld::square(10, GetParam()), true, 0, GetParam());
  expect_closed(closing);
  EXPECT_EQ(closing.geometry.map().keyframe(KeyframeId(3)).scale, 1.0);
}

TEST_P(LoopCloserSeeds, ClosesTheSquareWithoutDepth) {
  Closing closing(CorridorWorld::square(10, GetParam()), false, 0.001, GetParam());
  expect_closed(closing);
}

TEST_P(LoopCloserSeeds, RepeatedDoorsAreNoLoop) {
  for (const bool with_depth : {true, false}) {
    Closing closing(CorridorWorld::repeated_doors(40, 5, GetParam()), with_depth, 0, GetParam());
    closing.run();
    EXPECT_EQ(closing.closer.num_closed(), 0);
    EXPECT_EQ(closing.closer.num_reconnected(), 0);
  }
}

TEST_P(LoopCloserSeeds, ClosesWhereKeyframesHaveFewLandmarks) {
  for (const bool with_depth : {true, false}) {
    Closing closing(CorridorWorld::square(10, GetParam(), 12), with_depth, 0, GetParam());
    for (size_t k = 0; k < closing.corridor.truth.size(); ++k) {
      ASSERT_LT(closing.geometry.map().keyframe(KeyframeId(static_cast<int32_t>(k))).landmarks.size(), 100);
    }
    expect_closed(closing);
  }
}

TEST_P(LoopCloserSeeds, ClosesWhereLandmarksAreMadeMoreThanOnce) {
  Closing closing(CorridorWorld::square(10, GetParam()), true, 0, GetParam());
  closing.geometry.set_map(closing.corridor.drifted_map(0.004, 0.002, 0, true, GetParam(), 0.3));
  expect_closed(closing);
}

TEST(LoopCloser, RecognizesTheLandmarksOfAPlaceThatIsMet) {
  CorridorWorld corridor = CorridorWorld::square(10, 3);
  Closing closing(corridor, true, 0, 3);
  closing.geometry.set_map(corridor.drifted_map(0, 0, 0, true, 3));
  const auto last = KeyframeId(static_cast<int32_t>(corridor.truth.size()) - 1);
  const auto sees_the_start = [&] {
    const auto covisible = closing.geometry.map().covisible_keyframes(last, 15);
    return std::ranges::any_of(covisible, [](const auto& k) { return k.keyframe.value < 40; });
  };
  ASSERT_FALSE(sees_the_start());
  closing.run();
  EXPECT_TRUE(sees_the_start());
  EXPECT_EQ(closing.closer.num_closed(), 0);
  EXPECT_LT(closing.gap(), 0.02);
}

TEST(LoopCloser, CulledKeyframesAreNoWayAround) {
  CorridorWorld corridor = CorridorWorld::repeated_doors(20, 100, 3);
  for (const bool with_gap : {false, true}) {
    Map map = corridor.drifted_map(0, 0, 0, true, 3);
    for (int k = 35; k < 40; ++k) {
      if (!with_gap) map.cull_keyframe(KeyframeId(k));
      for (const LandmarkId id : std::vector<LandmarkId>(map.keyframe(KeyframeId(k)).landmarks)) {
        if (id.valid()) map.remove_observation(id, KeyframeId(k));
      }
    }
    LoopClosureOptions options;
    options.detection.min_keyframe_gap = 5;
    options.detection.min_matches = 1000;  // this is about what tracking has found
    LoopCloser closer(options, orb(), corridor.world.camera, corridor.world.bf);
    closer.process(*map.snapshot());
    EXPECT_EQ(closer.num_reconnected(), with_gap ? 1 : 0);
  }
}

/// As a session keeps it.
std::string saved(GeometryMapper& geometry) {
  Archive archive;
  archive(geometry);
  return archive.bytes();
}

TEST(LoopCloser, GoesOnInASessionWhereItWas) {
  const CorridorWorld corridor = CorridorWorld::square(10, 3);
  Closing whole(corridor, true, 0, 3);
  whole.run();
  const std::string expected = saved(whole.geometry);
  // Saved after so many corrections; the next one was on its way, and is lost.
  for (int num_applied = 0; num_applied < whole.geometry.snapshot()->num_corrections; ++num_applied) {
    Closing first(corridor, true, 0, 3);
    auto map = first.geometry.snapshot();
    for (int i = 0; i < num_applied; ++i) map = first.geometry.correct(first.closer.process(*map).value());
    EXPECT_EQ(map->adjustment_is_due, num_applied == 1) << "the loop is closed, and no more";
    ASSERT_TRUE(first.closer.process(*map).has_value());
    EXPECT_LT(first.closer.num_settled(), static_cast<int>(map->keyframes.size()));
    const std::string session = saved(first.geometry);

    Closing second(corridor, true, 0, 3);
    Archive reader(session);
    reader(second.geometry);
    second.closer.resume(*second.geometry.snapshot(), first.closer.num_settled());
    second.run();
    EXPECT_TRUE(saved(second.geometry) == expected) << num_applied;
    EXPECT_EQ(second.closer.num_settled(), static_cast<int>(corridor.truth.size()));
  }
}

TEST(LoopCloser, AnInterruptedAdjustmentStaysDue) {
  Closing closing(CorridorWorld::square(10, 3), true, 0, 3);
  auto map = closing.geometry.correct(closing.closer.process(*closing.geometry.snapshot()).value());
  ASSERT_TRUE(map->adjustment_is_due);
  const MapCorrection stopped = closing.closer.process(*map, [] { return true; }).value();
  EXPECT_TRUE(stopped.wrong_observations.empty()) << "what does not fit yet may be what holds the loop";
  map = closing.geometry.correct(stopped);
  EXPECT_TRUE(map->adjustment_is_due);
  map = closing.geometry.correct(closing.closer.process(*map).value());
  EXPECT_FALSE(map->adjustment_is_due);
  EXPECT_LT(closing.ate(), 0.005 * closing.corridor.path_length());
}

TEST(FullAdjustment, LandmarksTakenForOneAnotherLeaveTheMap) {
  for (const bool with_depth : {true, false}) {
    Closing closing(CorridorWorld::square(10, 3), with_depth, 0, 3);
    Map map = closing.corridor.drifted_map(0.0005, 0, 0, with_depth, 3);
    // In the first and last keyframes, as when a loop is fused.
    const auto last = KeyframeId(static_cast<int32_t>(map.num_keyframes()) - 1);
    std::vector<LandmarkId> old_place, new_place;
    for (int32_t k = 0; k < 5; ++k) {
      for (const LandmarkId id : map.keyframe(KeyframeId(5 + k)).landmarks) old_place.push_back(id);
      for (const LandmarkId id : map.keyframe(KeyframeId(last.value - k)).landmarks) new_place.push_back(id);
    }
    Random random(5);
    std::set<LandmarkId> wrong;
    while (wrong.size() < 40) {
      const LandmarkId a = old_place[static_cast<size_t>(random.index(static_cast<int>(old_place.size())))];
      const LandmarkId b = new_place[static_cast<size_t>(random.index(static_cast<int>(new_place.size())))];
      if (!a.valid() || !b.valid() || a == b || !map.landmark(a).view.alive || !map.landmark(b).view.alive) continue;
      map.fuse(b, a);
      wrong.insert(a);
    }
    closing.geometry.set_map(std::move(map));
    const BundleOptions options{.max_iterations = 50, .relative_cost_tolerance = 1e-6};
    closing.geometry.correct(
        adjust_everything(options, closing.corridor.world.camera, closing.bf, *closing.geometry.snapshot()));
    EXPECT_LT(closing.ate(), 0.001 * closing.corridor.path_length());
    for (const LandmarkId id : wrong) {
      const auto& observations = closing.geometry.map().landmark(id).observations;
      const auto is_old = [&](const LandmarkObservation& o) { return o.keyframe.value < 40; };
      const auto old = std::ranges::count_if(observations, is_old);
      EXPECT_TRUE(old == 0 || old == std::ssize(observations)) << id.value;
    }
  }
}

TEST(LoopDetector, FindsTheParentsOfCulledKeyframes) {
  CorridorWorld corridor = CorridorWorld::square(10, 3);
  Map map = corridor.drifted_map(0.004, 0.002, 0, true, 3);
  LoopDetectorOptions options;
  options.max_candidates = 1;
  LoopDetector detector(options, orb(), corridor.world.camera, corridor.world.bf, false);
  const auto now = KeyframeId(static_cast<int32_t>(corridor.truth.size()) - 1);
  const auto place = map.snapshot();
  for (KeyframeId id(0); id < now; ++id.value) detector.add(*place, id);

  // The lap is 133.3 steps long: those are the keyframes of the first that are nearest.
  for (const int culled : {12, 13, 11}) map.cull_keyframe(KeyframeId(culled));
  const auto loop = detector.detect(*map.snapshot(), now);
  ASSERT_TRUE(loop.has_value());
  EXPECT_EQ(loop->then, KeyframeId(10));
}

/// Cuts a map in two: what keyframes from `first` on see becomes a map of its own, somewhere else in the world.
Map cut(Map map, KeyframeId first, const Sim3& elsewhere) {
  std::vector<Sim3> moves(map.num_keyframes());
  for (size_t k = 0; k < map.num_keyframes(); ++k) {
    const KeyframeId id(static_cast<int32_t>(k));
    if (id < first) continue;
    moves[k] = elsewhere;
    const std::vector<LandmarkId> seen = map.keyframe(id).landmarks;
    for (const LandmarkId landmark : seen) {
      if (landmark.valid() && map.landmark(landmark).observations.front().keyframe < first) {
        map.remove_observation(landmark, id);
      }
    }
  }
  map.set_parent(first, KeyframeId{});
  map.apply({.new_world_from_old_world = moves});
  return map;
}

TEST(LoopCloser, JoinsTwoMapsThatMeet) {
  for (const bool with_depth : {true, false}) {
    CorridorWorld corridor = CorridorWorld::square(10, 3);
    Map drifted = corridor.drifted_map(0.002, 0.0005, 0, with_depth, 3);
    const Sim3 elsewhere(with_depth ? 1.0 : 1.6, so3_exp(Vec3(0.5, 2, -1)), Vec3(-1000, 20, 3));
    Closing closing(corridor, with_depth, 0, 3);
    closing.geometry.set_map(cut(std::move(drifted), KeyframeId(100), elsewhere));
    const double before = closing.gap();
    closing.run();
    EXPECT_GE(closing.closer.num_closed(), 1);
    EXPECT_GT(before, with_depth ? 900 : 5);
    EXPECT_LT(closing.gap(), 0.3);
    EXPECT_FALSE(closing.geometry.map().keyframe(KeyframeId(0)).parent.valid());
    for (size_t k = 1; k < corridor.truth.size(); ++k) {
      const KeyframeId parent = closing.geometry.map().keyframe(KeyframeId(static_cast<int32_t>(k))).parent;
      ASSERT_TRUE(parent.valid()) << k;
      const SE3 from_parent = corridor.truth[k] * corridor.truth[static_cast<size_t>(parent.value)].inverse();
      EXPECT_LT(from_parent.translation.norm(), 5) << k << " sees what its parent sees";
    }
  }
}

TEST(FullAdjustment, KeepsTheSizeOfEveryMapOfASingleCamera) {
  CorridorWorld corridor = CorridorWorld::square(10, 3);
  GeometryMapper geometry({}, orb(), corridor.world.camera, 0);
  geometry.set_map(cut(corridor.drifted_map(0.002, 0.0005, 0, false, 3), KeyframeId(100),
                       Sim3(1.6, so3_exp(Vec3(0.5, 2, -1)), Vec3(-100, 20, 3))));
  const auto centre = [](const MapSnapshot& map, int k) {
    return map.keyframe(KeyframeId(k)).keyframe.camera_from_world.inverse().translation;
  };
  const auto before = geometry.snapshot();
  const auto after = geometry.correct(adjust_everything({.max_iterations = 10}, corridor.world.camera, 0, *before));
  for (const int held : {0, 1, 100, 101}) {
    EXPECT_LT((centre(*after, held) - centre(*before, held)).norm(), 1e-9) << held;
  }
  EXPECT_GT((centre(*after, 110) - centre(*before, 110)).norm(), 1e-4) << "the others have moved";
}

}  // namespace
}  // namespace photoslam
