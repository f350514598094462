// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/map.h"

#include <gtest/gtest.h>

#include "base/archive.h"
#include "map/testing/point_world.h"

namespace photoslam {
namespace {

constexpr int kLevels = 8;

void expect_consistent(const Map& map) {
  size_t from_landmarks = 0, from_keyframes = 0;
  for (size_t i = 0; i < map.num_landmarks(); ++i) {
    const LandmarkId id(static_cast<int32_t>(i));
    const Landmark& landmark = map.landmark(id);
    EXPECT_EQ(landmark.view.alive, !landmark.observations.empty());
    for (const auto& [keyframe, keypoint] : landmark.observations) {
      EXPECT_EQ(map.keyframe(keyframe).landmarks[static_cast<size_t>(keypoint)], id);
      ++from_landmarks;
    }
  }
  for (size_t k = 0; k < map.num_keyframes(); ++k) {
    for (const LandmarkId id : map.keyframe(KeyframeId(static_cast<int32_t>(k))).landmarks) {
      if (id.valid()) ++from_keyframes;
    }
  }
  EXPECT_EQ(from_landmarks, from_keyframes);
}

class MapTest : public ::testing::Test {
 protected:
  MapTest() : map(1.2, kLevels) {
    for (int k = 0; k < 4; ++k) {
      const SE3 pose = testing::PointWorld::camera_from_world(0.2 * k);
      map.add_keyframe(KeyframeId(k), world.observe(pose, k), pose);
    }
  }
  testing::PointWorld world;
  Map map;
};

TEST_F(MapTest, AppendedMapCountsOnFromItsOwnIds) {
  const LandmarkId dead = map.add_landmark(Vec3(0, 0, 3), KeyframeId(0), 0);
  const LandmarkId seen = map.add_landmark(Vec3(0, 1, 3), KeyframeId(1), 2);
  map.add_observation(seen, KeyframeId(3), 4);
  map.fuse(dead, seen);
  map.set_parent(KeyframeId(2), KeyframeId(1));
  Map other(1.2, 8);
  other.append(map);
  map.append(other);
  EXPECT_EQ(map.num_keyframes(), 8u);
  EXPECT_EQ(map.keyframe(KeyframeId(6)).parent, KeyframeId(5));
  EXPECT_FALSE(map.keyframe(KeyframeId(4)).parent.valid());
  EXPECT_EQ(map.keyframe(KeyframeId(5)).landmarks[2], LandmarkId(3));
  EXPECT_EQ(map.living(LandmarkId(2)), LandmarkId(3));
  expect_consistent(map);
  const auto snapshot = map.snapshot();
  LandmarkId found(2);
  ASSERT_NE(snapshot->find(found), nullptr);
  EXPECT_EQ(found, LandmarkId(3));
  EXPECT_EQ(snapshot->root_of(KeyframeId(6)), KeyframeId(5));
}

TEST_F(MapTest, StaysConsistentUnderRandomOperations) {
  Random random(5);
  for (int step = 0; step < 3000; ++step) {
    const KeyframeId keyframe(random.index(4));
    const int keypoint = random.index(static_cast<int>(map.keyframe(keyframe).frame->size()));
    const LandmarkId any(map.num_landmarks() > 0 ? random.index(static_cast<int>(map.num_landmarks())) : -1);
    const int action = random.index(10);
    if (!any.valid() || action < 3) {
      if (!map.keyframe(keyframe).landmarks[static_cast<size_t>(keypoint)].valid()) {
        map.add_landmark(Vec3(0, 0, 3), keyframe, keypoint);
      }
    } else if (action < 6) {
      map.add_observation(any, keyframe, keypoint);
    } else if (action < 8) {
      map.remove_observation(any, keyframe);
    } else if (action == 8) {
      const LandmarkId other(random.index(static_cast<int>(map.num_landmarks())));
      if (map.landmark(any).view.alive && map.landmark(other).view.alive) map.fuse(any, other);
    } else {
      map.erase_landmark(any);
    }
  }
  expect_consistent(map);
}

TEST_F(MapTest, WhatTheMapForgetsItsSnapshotForgets) {
  const LandmarkId kept = map.add_landmark(Vec3(0, 0, 3), KeyframeId(0), 0);
  const auto fuse_another = [&] {
    const LandmarkId another = map.add_landmark(Vec3(0, 0, 3), KeyframeId(1), 0);
    map.fuse(another, kept);
    map.remove_observation(kept, KeyframeId(1));
    return another;
  };
  const LandmarkId first = fuse_another();
  for (size_t i = 1; i < LandmarkTable::kMaxReplacements; ++i) fuse_another();
  LandmarkId found = first;
  EXPECT_NE(map.snapshot()->find(found), nullptr);
  EXPECT_EQ(map.living(first), kept);
  fuse_another();
  found = first;
  EXPECT_EQ(map.snapshot()->find(found), nullptr);
  EXPECT_FALSE(map.living(first).valid());
}

TEST_F(MapTest, AFusedLandmarkIsFoundThroughItsSuccessor) {
  const LandmarkId a = map.add_landmark(Vec3(0, 0, 3), KeyframeId(0), 0);
  const LandmarkId b = map.add_landmark(Vec3(0, 0, 3), KeyframeId(1), 0);
  const LandmarkId c = map.add_landmark(Vec3(0, 0, 3), KeyframeId(2), 0);
  map.fuse(a, b);
  map.fuse(b, c);
  const auto snapshot = map.snapshot();
  LandmarkId id = a;
  ASSERT_NE(snapshot->find(id), nullptr);
  EXPECT_EQ(id, c);
  EXPECT_EQ(map.landmark(c).observations.size(), 3u);
  map.erase_landmark(c);
  LandmarkId again = a;
  EXPECT_EQ(map.snapshot()->find(again), nullptr);
  LandmarkId still = a;
  EXPECT_NE(snapshot->find(still), nullptr) << "a snapshot never changes";
}

TEST_F(MapTest, SnapshotsShareWhatDidNotChange) {
  for (int i = 0; i < 3 * LandmarkChunk::kSize / 2; ++i) {
    const KeyframeId keyframe(i % 4);
    map.add_landmark(Vec3(0, 0, 3), keyframe, i / 4);
  }
  const auto first = map.snapshot();
  map.set_position(LandmarkId(LandmarkChunk::kSize + 1), Vec3(1, 2, 3));
  map.set_pose(KeyframeId(2), SE3{});
  const auto second = map.snapshot();
  EXPECT_EQ(first->landmark_chunks[0], second->landmark_chunks[0]);
  EXPECT_NE(first->landmark_chunks[1], second->landmark_chunks[1]);
  EXPECT_EQ(first->keyframes[1], second->keyframes[1]);
  EXPECT_NE(first->keyframes[2], second->keyframes[2]);
  LandmarkId moved(LandmarkChunk::kSize + 1);
  EXPECT_EQ(second->find(moved)->position, Vec3(1, 2, 3));
}

TEST_F(MapTest, CovisibilityCountsSharedLandmarksStrongestFirst) {
  for (int i = 0; i < 20; ++i) {
    const LandmarkId id = map.add_landmark(Vec3(0, 0, 3), KeyframeId(0), i);
    map.add_observation(id, KeyframeId(1), i);
    if (i < 5) map.add_observation(id, KeyframeId(3), i);
  }
  const auto all = map.covisible_keyframes(KeyframeId(0), 1);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].keyframe, KeyframeId(1));
  EXPECT_EQ(all[0].shared_landmarks, 20);
  EXPECT_EQ(all[1].keyframe, KeyframeId(3));
  EXPECT_EQ(map.covisible_keyframes(KeyframeId(0), 6).size(), 1u);
}

TEST_F(MapTest, ViewOfALandmarkFollowsItsObservers) {
  const Vec3 position(0.1, 0.2, 3);
  const LandmarkId id = map.add_landmark(position, KeyframeId(0), 0);
  const LandmarkView& view = map.landmark(id).view;
  EXPECT_LT((view.normal - position.normalized()).norm(), 1e-12) << "seen from the origin";
  const int octave = map.keyframe(KeyframeId(0)).frame->features.keypoints[0].octave;
  EXPECT_NEAR(view.max_distance, position.norm() * std::pow(1.2, octave), 1e-12) << "there it appears on octave 0";
  EXPECT_NEAR(view.min_distance, view.max_distance / std::pow(1.2, kLevels - 1), 1e-12);
  EXPECT_EQ(view.descriptor, map.keyframe(KeyframeId(0)).frame->features.descriptors[0]);
}

/// Two keyframes that see the same points, and a third one made after the second.
TEST_F(MapTest, ACulledKeyframeSeesNothingAndFollowsItsParent) {
  for (int k = 1; k < 4; ++k) map.set_parent(KeyframeId(k), KeyframeId(k - 1));
  const LandmarkId shared = map.add_landmark(Vec3(0, 0, 3), KeyframeId(1), 0);
  map.add_observation(shared, KeyframeId(2), 0);
  const LandmarkId lonely = map.add_landmark(Vec3(0, 0, 3), KeyframeId(2), 1);
  const auto pose = [&](int k) { return map.keyframe(KeyframeId(k)).camera_from_world; };

  map.cull_keyframe(KeyframeId(2));
  map.cull_keyframe(KeyframeId(1));
  expect_consistent(map);
  EXPECT_FALSE(map.landmark(shared).view.alive);
  EXPECT_FALSE(map.landmark(lonely).view.alive);
  EXPECT_EQ(map.keyframe(KeyframeId(2)).frame->size(), 0u);
  EXPECT_EQ(map.keyframe(KeyframeId(2)).frame->timestamp_ns, world.observe(SE3{}, 2)->timestamp_ns);
  for (int k = 1; k < 4; ++k) EXPECT_EQ(map.keyframe(KeyframeId(k)).parent, KeyframeId(0));
  EXPECT_EQ(map.living(KeyframeId(2)), KeyframeId(0));

  const SE3 before = pose(2) * pose(0).inverse(), free_before = pose(3);
  map.set_pose(KeyframeId(0), SE3(so3_exp(Vec3(0.1, -0.2, 0.3)), Vec3(1, 2, 3)));
  EXPECT_LT((pose(2) * pose(0).inverse() * before.inverse()).log().norm(), 1e-12);
  EXPECT_LT((pose(3) * free_before.inverse()).log().norm(), 1e-15);
}

TEST_F(MapTest, ACorrectionMovesCulledKeyframesWithTheirParentAtItsScale) {
  for (int k = 1; k < 4; ++k) map.set_parent(KeyframeId(k), KeyframeId(0));
  map.cull_keyframe(KeyframeId(2));
  const auto relative = [&] {
    return map.keyframe(KeyframeId(2)).camera_from_world * map.keyframe(KeyframeId(0)).camera_from_world.inverse();
  };
  const SE3 before = relative();
  MapCorrection correction;
  const Sim3 of_parent(1.7, so3_exp(Vec3(0.2, 0.1, -0.3)), Vec3(0.5, -1, 2));
  correction.new_world_from_old_world = {of_parent, Sim3{}, Sim3{}, Sim3{}};
  map.apply(correction);
  EXPECT_LT((relative().translation - 1.7 * before.translation).norm(), 1e-12);
  EXPECT_LT(so3_log(relative().rotation * before.rotation.inverse()).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(map.keyframe(KeyframeId(2)).scale, 1.7);
  EXPECT_DOUBLE_EQ(map.keyframe(KeyframeId(1)).scale, 1.0);
  // And it still follows.
  const SE3 corrected = relative();
  map.set_pose(KeyframeId(0), SE3(so3_exp(Vec3(0.1, 0, 0)), Vec3(1, 0, 0)));
  EXPECT_LT((relative() * corrected.inverse()).log().norm(), 1e-12);
}

TEST_F(MapTest, AMapThatJoinsAnotherHangsWhereTheyMeet) {
  // 0; 1 ← 2 ← 3, where 2 is culled when the correction arrives.
  for (int k = 2; k < 4; ++k) map.set_parent(KeyframeId(k), KeyframeId(k - 1));
  map.cull_keyframe(KeyframeId(2));
  map.join(KeyframeId(3), KeyframeId(0));
  const auto parent = [&](int k) { return map.keyframe(KeyframeId(k)).parent; };
  EXPECT_FALSE(parent(0).valid());
  EXPECT_EQ(parent(3), KeyframeId(0));
  EXPECT_EQ(parent(1), KeyframeId(3));
  EXPECT_EQ(parent(2), KeyframeId(1)) << "still follows what it was culled for";
}

class CorrectedMap : public ::testing::Test {
 protected:
  CorrectedMap() {
    for (int k = 0; k < 3; ++k) {
      const SE3 pose = testing::PointWorld::camera_from_world(0.2 * k);
      const auto frame = world.observe(pose, k);
      map.add_keyframe(KeyframeId(k), frame, pose);
      if (k > 0) map.set_parent(KeyframeId(k), KeyframeId(k - 1));
      for (size_t i = 0; i < frame->size(); ++i) {
        const int point = world.point_of_keypoint[i];
        if (const auto known = landmark_of_point.find(point); known != landmark_of_point.end()) {
          map.add_observation(known->second, KeyframeId(k), static_cast<int>(i));
        } else {
          landmark_of_point[point] =
              map.add_landmark(world.points[static_cast<size_t>(point)], KeyframeId(k), static_cast<int>(i));
        }
      }
    }
  }

  std::vector<Vec2> projections() const {
    std::vector<Vec2> result;
    for (int k = 0; k < 3; ++k) {
      const Keyframe& keyframe = map.keyframe(KeyframeId(k));
      for (const LandmarkId id : keyframe.landmarks) {
        result.push_back(world.camera.project(keyframe.camera_from_world * map.landmark(id).view.position));
      }
    }
    return result;
  }

  testing::PointWorld world{1, 400};
  Map map{testing::PointWorld::kScaleFactor, testing::PointWorld::kNumLevels};
  std::map<int, LandmarkId> landmark_of_point;
};

TEST_F(CorrectedMap, AUniformSimilarityChangesNoProjection) {
  const Sim3 move(1.4, so3_exp(Vec3(0.2, -0.5, 0.1)), Vec3(1, 2, -3));
  const auto before = projections();
  map.apply({.new_world_from_old_world = {move, move}});
  const auto after = projections();
  ASSERT_EQ(before.size(), after.size());
  for (size_t i = 0; i < before.size(); ++i) EXPECT_LT((before[i] - after[i]).norm(), 1e-9) << i;
  EXPECT_DOUBLE_EQ(map.keyframe(KeyframeId(1)).scale, 1.4);
  EXPECT_EQ(map.snapshot()->num_corrections, 1);
}

TEST_F(CorrectedMap, WhatCameLaterFollowsItsAncestor) {
  const Sim3 stay, move(1.0, so3_exp(Vec3(0, 0.3, 0)), Vec3(0.5, 0, 0));
  const SE3 relative =
      map.keyframe(KeyframeId(2)).camera_from_world * map.keyframe(KeyframeId(1)).camera_from_world.inverse();
  map.apply({.new_world_from_old_world = {stay, move}});
  const SE3 now =
      map.keyframe(KeyframeId(2)).camera_from_world * map.keyframe(KeyframeId(1)).camera_from_world.inverse();
  EXPECT_LT((now * relative.inverse()).log().norm(), 1e-12);
}

TEST_F(CorrectedMap, LandmarksFollowTheirOldestObserverAndShift) {
  const LandmarkId id = map.keyframe(KeyframeId(0)).landmarks[0];
  const Vec3 before = map.landmark(id).view.position;
  const Sim3 move0(SE3(Quat::Identity(), Vec3(0, 0, 1))), move1(SE3(Quat::Identity(), Vec3(5, 0, 0)));
  map.apply({.new_world_from_old_world = {move0, move1}, .landmark_shifts = {{id, Vec3(0, 0.25, 0)}}});
  EXPECT_LT((map.landmark(id).view.position - before - Vec3(0, 0.25, 1)).norm(), 1e-12);
}

TEST_F(CorrectedMap, AnArchiveHoldsAllOfIt) {
  map.fuse(map.keyframe(KeyframeId(0)).landmarks[1], map.keyframe(KeyframeId(0)).landmarks[0]);
  Archive saved;
  map.serialize(saved, world.camera.width, world.camera.height);
  Map loaded(2.0, 1);
  for (int k = 0; k < 20; ++k) {  // of this nothing is left
    loaded.add_keyframe(KeyframeId(k), world.observe(SE3{}, k), SE3{});
    for (int i = 0; i < 20; ++i) loaded.add_landmark(Vec3(0, 0, 3), KeyframeId(k), i);
  }
  Archive reader(saved.bytes());
  loaded.serialize(reader, world.camera.width, world.camera.height);
  EXPECT_TRUE(reader.at_end());
  Archive saved_again;
  loaded.serialize(saved_again, world.camera.width, world.camera.height);
  EXPECT_EQ(saved_again.bytes(), saved.bytes());

  expect_consistent(loaded);
  const auto a = map.snapshot(), b = loaded.snapshot();
  ASSERT_EQ(a->keyframes.size(), b->keyframes.size());
  ASSERT_EQ(a->num_landmarks, b->num_landmarks);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(a->keyframe(KeyframeId(k)).median_depth, b->keyframe(KeyframeId(k)).median_depth);
    EXPECT_EQ(a->keyframe(KeyframeId(k)).covisible.size(), b->keyframe(KeyframeId(k)).covisible.size());
    EXPECT_EQ(a->keyframe(KeyframeId(k)).keyframe.parent, b->keyframe(KeyframeId(k)).keyframe.parent);
  }
  int near_a = 0, near_b = 0;  // the grid was built anew
  a->keyframe(KeyframeId(2)).keyframe.frame->grid.for_each_near(300, 200, 50, [&](int) { ++near_a; });
  b->keyframe(KeyframeId(2)).keyframe.frame->grid.for_each_near(300, 200, 50, [&](int) { ++near_b; });
  EXPECT_EQ(near_a, near_b);
  EXPECT_GT(near_b, 0);
}

TEST_F(CorrectedMap, AnArchiveDoesNotGrowWithTheDead) {
  const auto bytes = [&] {
    Archive saved;
    map.serialize(saved, world.camera.width, world.camera.height);
    return saved.bytes().size();
  };
  const size_t before = bytes();
  const LandmarkId place = map.keyframe(KeyframeId(0)).landmarks[0];
  map.erase_landmark(place);
  for (int i = 0; i < 1000; ++i) map.erase_landmark(map.add_landmark(Vec3(0, 0, 3), KeyframeId(0), 0));
  EXPECT_LE(bytes(), before);
  EXPECT_GE(map.num_landmarks(), 1000u);
}

}  // namespace
}  // namespace photoslam
