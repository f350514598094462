// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry_mapping/geometry_mapper.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "base/archive.h"
#include "map/testing/point_world.h"
#include "math/umeyama.h"

namespace photoslam {
namespace {

using testing::PointWorld;

/// Runs tracking and mapping together over the walk; returns the RMSE of the final frame poses [m].
class WalkTest : public ::testing::Test {
 protected:
  void walk(PointWorld& world, int num_frames, double start_s = 0) {
    begin(world);
    follow(world, 0, num_frames, 30, [&](int frame) { return PointWorld::camera_from_world(start_s + frame / 30.0); });
  }

  void begin(const PointWorld& world) {
    const double bf = world.with_depth ? world.bf : 0;
    tracker.emplace(TrackerOptions{}, OrbOptions{}, world.camera, bf);
    mapper.emplace(GeometryMapperOptions{}, OrbOptions{}, world.camera, bf);
    snapshot.reset();
  }

  void follow(PointWorld& world, int first, int last, double frames_per_second,
              const std::function<SE3(int)>& camera_from_world) {
    for (int frame = first; frame < last; ++frame) {
      const SE3 truth = camera_from_world(frame);
      const TrackingResult result = tracker->track(world.observe(truth, frame, frames_per_second), snapshot, true);
      if (frames.empty() && result.state == TrackingState::initializing) continue;
      ASSERT_TRUE(result.has_pose) << "frame " << frame << ": " << result.reason;
      frames.push_back({truth, result.reference, result.camera_from_reference});
      if (!result.keyframe) continue;
      proposals.push_back(*result.keyframe);
      updates.push_back(mapper->process(proposals.back()));
      snapshot = updates.back().map;
    }
  }

  int num_living_keyframes() const {
    int living = 0;
    for (size_t k = 0; k < mapper->map().num_keyframes(); ++k) {
      living += !mapper->map().keyframe(KeyframeId(static_cast<int32_t>(k))).culled;
    }
    return living;
  }

  double final_rmse() const {
    double sum = 0;
    for (const auto& frame : frames) {
      const SE3 estimate = frame.camera_from_reference * mapper->map().keyframe(frame.reference).camera_from_world;
      sum += (estimate.inverse().translation - frame.truth.inverse().translation).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(frames.size()));
  }

  /// The same after the best similarity transform: what a single camera can know.
  double final_rmse_with_scale() const {
    std::vector<Vec3> estimate, truth;
    for (const auto& frame : frames) {
      const SE3 pose = frame.camera_from_reference * mapper->map().keyframe(frame.reference).camera_from_world;
      estimate.push_back(pose.inverse().translation);
      truth.push_back(frame.truth.inverse().translation);
    }
    const Sim3 truth_from_estimate = align_umeyama(estimate, truth, true);
    double sum = 0;
    for (size_t i = 0; i < truth.size(); ++i) sum += (truth_from_estimate * estimate[i] - truth[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(truth.size()));
  }

  /// When the walk no longer sees a single wall only, which two motions would explain [s].
  static constexpr double kCornerInView = 1.5;

  struct TrackedFrame {
    SE3 truth;
    KeyframeId reference;
    SE3 camera_from_reference;
  };
  std::optional<Tracker> tracker;
  std::optional<GeometryMapper> mapper;
  std::shared_ptr<const MapSnapshot> snapshot;
  std::vector<KeyframeProposal> proposals;
  std::vector<GeometryUpdate> updates;
  std::vector<TrackedFrame> frames;
};

TEST_F(WalkTest, ExactFeaturesGiveAnExactMap) {
  PointWorld world;
  walk(world, 150);
  EXPECT_GE(updates.size(), 5u);
  EXPECT_LT(final_rmse(), 1e-4);
  size_t alive = 0;
  for (size_t i = 0; i < mapper->map().num_landmarks(); ++i) {
    const LandmarkView& view = mapper->map().landmark(LandmarkId(static_cast<int32_t>(i))).view;
    if (!view.alive) continue;
    ++alive;
    double nearest = 1e9;
    for (const Vec3& point : world.points) nearest = std::min(nearest, (point - view.position).norm());
    EXPECT_LT(nearest, 1e-3) << "landmark " << i;
  }
  EXPECT_GT(alive, 500u);
}

TEST_F(WalkTest, ASceneThatBeginsBeyondTheRangeOfTheRigIsTracked) {
  PointWorld world;
  world.bf = 20;  // 30 baselines are 1.1 m: only walls that are farther away
  walk(world, 60);
  EXPECT_EQ(frames.size(), 60u);
  EXPECT_GE(updates.front().new_landmarks, GeometryMapperOptions{}.min_landmarks);
  EXPECT_LT(final_rmse(), 1e-4);
}

TEST_F(WalkTest, NoisyFeaturesGiveTheAccuracyThatTheirNumberAllows) {
  PointWorld world;
  world.pixel_noise = 0.7;
  walk(world, 150);
  // Depth is the weak direction: one point at distance z fixes it to z² √2 σ / bf, n points √n times better. The walls
  // are about 3 m away, where points appear on octave 3, and some 400 are tracked. Poses are measured against the first
  // one, which has an error of the same size.
  const double sigma = world.pixel_noise * std::pow(PointWorld::kScaleFactor, 3);
  const double one_pose = 3.0 * 3.0 * std::sqrt(2.0) * sigma / world.bf / std::sqrt(400.0);
  EXPECT_LT(final_rmse(), std::sqrt(2.0) * one_pose);
}

TEST_F(WalkTest, ASingleCameraGivesTheSameMapUpToItsScale) {
  PointWorld world;
  world.with_depth = false;
  walk(world, 150, kCornerInView);
  EXPECT_GT(frames.size(), 130u) << "parallax, and certainty which motion it means, come within twenty frames";
  EXPECT_LT(final_rmse_with_scale(), 1e-4);
  // Landmarks of the parts that the first two views did not see were triangulated later.
  int late = 0;
  for (size_t i = 0; i < mapper->map().num_landmarks(); ++i) {
    const Landmark& landmark = mapper->map().landmark(LandmarkId(static_cast<int32_t>(i)));
    if (landmark.view.alive && landmark.created_by > KeyframeId(1)) ++late;
  }
  EXPECT_GT(late, 200);
}

TEST_F(WalkTest, ASingleCameraToleratesNoise) {
  PointWorld world;
  world.with_depth = false;
  world.pixel_noise = 0.5;
  walk(world, 150, kCornerInView);
  EXPECT_GT(frames.size(), 120u);
  double path = 0;
  for (size_t i = 1; i < frames.size(); ++i) {
    path += (frames[i].truth.inverse().translation - frames[i - 1].truth.inverse().translation).norm();
  }
  // Nothing but the chain of landmarks keeps the scale while the camera turns from wall to wall.
  EXPECT_LT(final_rmse_with_scale(), 0.01 * path);
}

TEST_F(WalkTest, LandmarksAreNotDuplicated) {
  PointWorld world;
  world.pixel_noise = 0.3;
  walk(world, 150);
  // Every world point is one landmark at most, but for those still on trial.
  std::map<uint64_t, int> landmarks_of_descriptor;
  int alive = 0, duplicates = 0;
  for (size_t i = 0; i < mapper->map().num_landmarks(); ++i) {
    const Landmark& landmark = mapper->map().landmark(LandmarkId(static_cast<int32_t>(i)));
    if (!landmark.view.alive) continue;
    ++alive;
    if (landmarks_of_descriptor[landmark.view.descriptor[0]]++ > 0) ++duplicates;
  }
  EXPECT_LT(duplicates, alive / 50);
}

TEST_F(WalkTest, KeyframesOfAPlaceThatIsVisitedAgainAndAgainAreCulled) {
  PointWorld world;
  world.pixel_noise = 0.5;
  constexpr int kLap = 90, kLaps = 4;
  const auto lap = [](int frame) {
    const double angle = 2 * std::numbers::pi * frame / kLap;
    const Vec3 position(0.7 * std::sin(angle), 0, 0.7 * std::cos(angle) - 0.7);
    return SE3(so3_exp(Vec3(0, 0.6 * std::sin(angle), 0)), position).inverse();
  };
  begin(world);
  follow(world, 0, kLap, 10, lap);
  const int after_one_lap = num_living_keyframes();
  follow(world, kLap, kLaps * kLap, 10, lap);
  EXPECT_LT(num_living_keyframes(), 1.3 * after_one_lap);
  EXPECT_GT(mapper->map().num_keyframes(), 2 * static_cast<size_t>(after_one_lap));
  EXPECT_LT(final_rmse(), 0.01);
}

TEST_F(WalkTest, TheSameInputGivesTheSameMap) {
  PointWorld a, b;
  a.pixel_noise = b.pixel_noise = 0.5;
  walk(a, 60);
  const Map& map = mapper->map();
  std::vector<SE3> first;
  for (size_t k = 0; k < map.num_keyframes(); ++k) {
    first.push_back(map.keyframe(KeyframeId(static_cast<int32_t>(k))).camera_from_world);
  }
  frames.clear();
  updates.clear();
  walk(b, 60);
  ASSERT_EQ(mapper->map().num_keyframes(), first.size());
  for (size_t k = 0; k < first.size(); ++k) {
    const SE3& pose = mapper->map().keyframe(KeyframeId(static_cast<int32_t>(k))).camera_from_world;
    EXPECT_EQ(pose.translation, first[k].translation);
    EXPECT_EQ(pose.rotation.coeffs(), first[k].rotation.coeffs());
  }
}

TEST_F(WalkTest, AdjustmentBeginsEvenWhenTheNextKeyframeIsWaiting) {
  PointWorld world;
  world.pixel_noise = 1;
  walk(world, 90);
  GeometryMapper hurried({}, {}, world.camera, world.bf);
  int num_interrupted = 0;
  for (const KeyframeProposal& proposal : proposals) {
    const GeometryUpdate update = hurried.process(proposal, [] { return true; });
    if (hurried.map().num_keyframes() < 2) continue;
    EXPECT_LT(update.bundle.final_cost, update.bundle.initial_cost);
    if (!update.bundle.interrupted) continue;  // it has converged before
    ++num_interrupted;
    EXPECT_EQ(update.bundle.iterations, 2);
  }
  EXPECT_GT(num_interrupted, 0);
}

/// The keyframes of a walk, with corrections between them, in one go and by way of an archive in the middle.
TEST_F(WalkTest, ContinuesFromAnArchiveThroughCorrectionsAsIfNothingHadHappened) {
  PointWorld world;
  world.pixel_noise = 0.5;
  walk(world, 150);
  ASSERT_GE(proposals.size(), 6u);
  const auto make = [&] { return GeometryMapper({}, {}, world.camera, world.bf); };
  const auto process = [&](GeometryMapper& m, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) m.process(proposals[i]);
  };
  const auto correct = [](GeometryMapper& m, double x) {
    MapCorrection correction;
    for (size_t k = 0; k < m.map().num_keyframes(); ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(m.map().num_keyframes());
      correction.new_world_from_old_world.emplace_back(
          SE3(so3_exp(Vec3(0, 0.1 * x * share, 0)), Vec3(x * share, 0, 0)));
    }
    m.correct(correction);
  };
  GeometryMapper through = make(), before = make(), after = make();
  const size_t middle = proposals.size() / 2;
  for (GeometryMapper* m : {&through, &before}) {
    process(*m, 0, middle);
    correct(*m, 0.02);
  }
  Archive saved;
  before.serialize(saved);
  Archive reader(saved.bytes());
  after.serialize(reader);
  std::vector<std::string> ends;
  for (GeometryMapper* m : {&through, &after}) {
    process(*m, middle, middle + 2);
    correct(*m, -0.01);
    process(*m, middle + 2, proposals.size());
    Archive end;
    m->serialize(end);
    ends.push_back(end.take_bytes());
  }
  EXPECT_TRUE(ends[0] == ends[1]);
}

TEST(GeometryMapper, CorrectsLandmarksThatWereFusedInBetween) {
  PointWorld world;
  Map built(PointWorld::kScaleFactor, PointWorld::kNumLevels);
  std::vector<LandmarkId> ids;
  for (int k = 0; k < 4; ++k) {
    const SE3 pose = PointWorld::camera_from_world(0.2 * k);
    built.add_keyframe(KeyframeId(k), world.observe(pose, k), pose);
    ids.push_back(built.add_landmark(Vec3(0, 0, 3), KeyframeId(k), 0));
  }
  GeometryMapper geometry({}, {}, world.camera, world.bf);
  geometry.set_map(std::move(built));
  const Map& map = geometry.map();
  geometry.correct({.duplicates = {{ids[0], ids[1]}}});
  geometry.correct({.duplicates = {{ids[0], ids[2]}, {ids[1], ids[3]}}});
  for (const LandmarkId id : ids) EXPECT_EQ(map.living(id), ids[3]);
  ASSERT_EQ(map.landmark(ids[3]).observations.size(), 4u);
  geometry.correct({.wrong_observations = {{ids[0], KeyframeId(1)}}});
  EXPECT_EQ(map.landmark(ids[3]).observations.size(), 3u);
}

TEST(GeometryMapper, TakesAProposalThatPointsAtACulledKeyframe) {
  PointWorld world;
  Map built(PointWorld::kScaleFactor, PointWorld::kNumLevels);
  for (int k = 0; k < 2; ++k) {
    const SE3 pose = PointWorld::camera_from_world(0.2 * k);
    built.add_keyframe(KeyframeId(k), world.observe(pose, k), pose);
  }
  const LandmarkId seen = built.add_landmark(Vec3(0, 0, 3), KeyframeId(0), 0);
  built.set_parent(KeyframeId(1), KeyframeId(0));
  built.cull_keyframe(KeyframeId(1));
  GeometryMapper geometry({}, {}, world.camera, world.bf);
  geometry.set_map(std::move(built));

  KeyframeProposal proposal;
  proposal.id = KeyframeId(2);
  proposal.reference = KeyframeId(1);
  proposal.camera_from_reference = PointWorld::camera_from_world(0.4) * PointWorld::camera_from_world(0.2).inverse();
  proposal.frame = world.observe(PointWorld::camera_from_world(0.4), 2);
  proposal.landmarks.resize(proposal.frame->size());
  proposal.same_as = {{0, {KeyframeId(1), 0}}, {1, {KeyframeId(0), 0}}};
  const GeometryUpdate update = geometry.process(proposal);
  EXPECT_EQ(update.keyframe, KeyframeId(2));
  EXPECT_EQ(geometry.map().keyframe(KeyframeId(2)).parent, KeyframeId(0)) << "the culled one's parent";
  EXPECT_NE(geometry.map().keyframe(KeyframeId(2)).landmarks[0], seen);
}

/// Two keyframes propose themselves one after the other, and a frame is tracked, before a loop changes the scale.
TEST(GeometryMapper, WhatWasMeasuredBeforeACorrectionFollowsItsScale) {
  constexpr double kGrowth = 1.7;
  PointWorld world;
  world.with_depth = false;
  const auto truth = [](int k) { return PointWorld::camera_from_world(0.2 * k); };
  Map built(PointWorld::kScaleFactor, PointWorld::kNumLevels);
  std::vector<LandmarkId> landmark_of_point(world.points.size());
  for (int k = 0; k < 2; ++k) {
    built.add_keyframe(KeyframeId(k), world.observe(truth(k), k), truth(k));
    if (k > 0) built.set_parent(KeyframeId(1), KeyframeId(0));
    for (size_t i = 0; i < world.point_of_keypoint.size(); ++i) {
      const auto point = static_cast<size_t>(world.point_of_keypoint[i]);
      LandmarkId& landmark = landmark_of_point[point];
      if (!landmark.valid()) {
        landmark = built.add_landmark(world.points[point], KeyframeId(k), static_cast<int>(i));
      } else if (built.add_observation(landmark, KeyframeId(k), static_cast<int>(i))) {
        built.update_view(landmark);
      }
    }
  }
  std::vector<KeyframeProposal> proposals(2);
  for (int k = 2; k < 4; ++k) {
    KeyframeProposal& proposal = proposals[static_cast<size_t>(k - 2)];
    proposal.id = KeyframeId(k);
    proposal.frame = world.observe(truth(k), k);
    proposal.reference = KeyframeId(k - 1);
    proposal.camera_from_reference = truth(k) * truth(k - 1).inverse();
    for (const int point : world.point_of_keypoint) {
      proposal.landmarks.push_back(landmark_of_point[static_cast<size_t>(point)]);
    }
  }
  const SE3 frame_from_last = truth(4) * truth(3).inverse();

  GeometryMapper geometry({}, {}, world.camera, 0);
  geometry.set_map(std::move(built));
  const Sim3 grow(kGrowth, Quat::Identity(), Vec3::Zero());
  geometry.correct({.new_world_from_old_world = {grow, grow}});
  const auto expected = [&](int k) { return SE3(truth(k).rotation, kGrowth * truth(k).translation); };
  for (const KeyframeProposal& proposal : proposals) {
    geometry.process(proposal);
    const Keyframe& keyframe = geometry.map().keyframe(proposal.id);
    EXPECT_DOUBLE_EQ(keyframe.scale, kGrowth);
    EXPECT_LT((keyframe.camera_from_world * expected(proposal.id.value).inverse()).log().norm(), 1e-4);
  }
  // As the final pose of a frame is found.
  const Keyframe& last = geometry.map().keyframe(KeyframeId(3));
  const SE3 frame = SE3(frame_from_last.rotation, last.scale * frame_from_last.translation) * last.camera_from_world;
  EXPECT_LT((frame * expected(4).inverse()).log().norm(), 1e-4);
}

}  // namespace
}  // namespace photoslam
