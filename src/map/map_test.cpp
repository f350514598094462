// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/map.h"

#include <gtest/gtest.h>

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
  for (int i = 0; i < 3 * MapSnapshot::kChunk / 2; ++i) {
    const KeyframeId keyframe(i % 4);
    map.add_landmark(Vec3(0, 0, 3), keyframe, i / 4);
  }
  const auto first = map.snapshot();
  map.set_position(LandmarkId(MapSnapshot::kChunk + 1), Vec3(1, 2, 3));
  map.set_pose(KeyframeId(2), SE3{});
  const auto second = map.snapshot();
  EXPECT_EQ(first->landmark_chunks[0], second->landmark_chunks[0]);
  EXPECT_NE(first->landmark_chunks[1], second->landmark_chunks[1]);
  EXPECT_EQ(first->keyframes[1], second->keyframes[1]);
  EXPECT_NE(first->keyframes[2], second->keyframes[2]);
  LandmarkId moved(MapSnapshot::kChunk + 1);
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

}  // namespace
}  // namespace photoslam
