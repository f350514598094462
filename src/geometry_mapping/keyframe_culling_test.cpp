// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry_mapping/keyframe_culling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace photoslam {
namespace {

constexpr int kKeypoints = 100;

/// A map whose keyframe k finds its keypoints on octave octaves[k]; keypoint i of all of them sees the same landmark.
Map map_of(const std::vector<int>& octaves) {
  Map map(1.2, 8);
  for (size_t k = 0; k < octaves.size(); ++k) {
    auto frame = std::make_shared<FeatureFrame>();
    frame->features.keypoints.resize(kKeypoints, Keypoint{.octave = octaves[k]});
    frame->features.descriptors.resize(kKeypoints);
    map.add_keyframe(KeyframeId(static_cast<int32_t>(k)), frame, SE3{});
  }
  for (int i = 0; i < kKeypoints; ++i) {
    const LandmarkId landmark = map.add_landmark(Vec3(0, 0, 3), KeyframeId(0), i);
    for (size_t k = 1; k < octaves.size(); ++k) map.add_observation(landmark, KeyframeId(static_cast<int32_t>(k)), i);
  }
  return map;
}

/// Leaves keyframe 0 the only one to see so many of its landmarks.
void keep_for_first(Map& map, int count) {
  for (int i = 0; i < count; ++i) {
    const LandmarkId landmark = map.keyframe(KeyframeId(0)).landmarks[static_cast<size_t>(i)];
    for (size_t k = 1; k < map.num_keyframes(); ++k) {
      map.remove_observation(landmark, KeyframeId(static_cast<int32_t>(k)));
    }
  }
}

TEST(KeyframeCulling, ThreeOthersThatSeeTheSameMakeAKeyframeRedundant) {
  EXPECT_TRUE(is_redundant({}, map_of({2, 2, 2, 2}), KeyframeId(0)));
  EXPECT_FALSE(is_redundant({}, map_of({2, 2, 2}), KeyframeId(0)));
}

TEST(KeyframeCulling, OthersMustSeeAsSharply) {
  EXPECT_TRUE(is_redundant({}, map_of({2, 3, 3, 0}), KeyframeId(0))) << "one level coarser is as good";
  EXPECT_FALSE(is_redundant({}, map_of({2, 4, 4, 4}), KeyframeId(0)));
  EXPECT_TRUE(is_redundant({}, map_of({2, 4, 4, 4, 4}), KeyframeId(1)));
}

TEST(KeyframeCulling, TheShareOfLandmarksOfItsOwnDecides) {
  Map map = map_of({2, 2, 2, 2});
  keep_for_first(map, 10);
  EXPECT_TRUE(is_redundant({}, map, KeyframeId(0)));
  keep_for_first(map, 11);
  EXPECT_FALSE(is_redundant({}, map, KeyframeId(0)));
}

}  // namespace
}  // namespace photoslam
