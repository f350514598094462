// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/feature_depth.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

// Corners of a square on a plane whose inverse depth grows along x, as it does on every plane in an image.
float plane_depth(float x) { return 1.0f / (0.4f + 0.002f * x); }
DepthPixel known(float x, float y) { return {x, y, plane_depth(x)}; }

TEST(InterpolateDepth, IsExactInTheMiddleOfASlantedPlane) {
  std::vector<DepthPixel> pixels = {known(10, 10), known(30, 10), known(10, 30), known(30, 30), {20, 20, 0}};
  interpolate_depth({}, pixels);
  EXPECT_NEAR(pixels[4].depth, plane_depth(20), 1e-5f);
}

TEST(InterpolateDepth, TheNearestCountsMost) {
  std::vector<DepthPixel> pixels = {known(10, 10), known(30, 10), known(10, 30), known(30, 30), {11, 11, 0}};
  interpolate_depth({}, pixels);
  EXPECT_NEAR(pixels[4].depth, plane_depth(10), 0.02f);
  EXPECT_LT(pixels[4].depth, plane_depth(10)) << "drawn a little towards the others, which are nearer";
}

TEST(InterpolateDepth, RefusesADepthGapAndTheFarAway) {
  std::vector<DepthPixel> across = {{10, 10, 1.0f}, {30, 10, 1.0f}, {10, 30, 2.0f}, {30, 30, 2.0f}, {20, 20, 0}};
  interpolate_depth({}, across);
  EXPECT_EQ(across[4].depth, 0) << "neither surface is invented nor something between them";
  std::vector<DepthPixel> away = {known(10, 10), known(30, 10), known(10, 30), known(30, 30), {120, 20, 0}};
  interpolate_depth({}, away);
  EXPECT_EQ(away[4].depth, 0);
}

TEST(InterpolateDepth, KeepsWhatIsKnownAndNeedsEnoughOfIt) {
  std::vector<DepthPixel> pixels = {known(10, 10), known(30, 10), known(10, 30), {20, 20, 0}};
  interpolate_depth({}, pixels);
  EXPECT_EQ(pixels[0].depth, plane_depth(10));
  EXPECT_EQ(pixels[3].depth, 0) << "three neighbours where four are asked for";
}

/// A keyframe with four features: an active one, one measured by the sensor, one in a picture with depth, and one with
/// nothing.
TEST(FeatureDepths, TakesTheBestSourceForEachFeature) {
  auto frame = std::make_shared<FeatureFrame>();
  for (const float x : {10.0f, 20.0f, 30.0f, 100.0f}) {
    Keypoint keypoint;
    keypoint.x = x;
    keypoint.y = 12;
    frame->features.keypoints.push_back(keypoint);
  }
  frame->depth = {9.0f, 2.0f, 0.0f, 0.0f};
  Keyframe keyframe;
  keyframe.frame = frame;
  keyframe.camera_from_world.translation = Vec3(0, 0, 1);
  keyframe.landmarks = {LandmarkId(0), LandmarkId(), LandmarkId(), LandmarkId()};
  MapSnapshot map;
  auto chunk = std::make_shared<LandmarkChunk>();
  LandmarkView landmark;
  landmark.alive = true;
  landmark.position = Vec3(0, 0, 3);
  chunk->add(0, landmark);
  map.landmark_chunks.push_back(chunk);
  map.num_landmarks = 1;
  DepthPicture picture{{64, 32, 50, 50, 32, 16}, {}, ImageF(64, 32), {}};
  picture.depth(15, 6) = 2.5f;  // the half-size pixel of (30, 12)
  picture.depth(10, 6) = 7.0f;  // that of (20, 12), which the sensor has measured

  const auto pixels = feature_depths({}, map, keyframe, picture, 2);
  ASSERT_EQ(pixels.size(), 3u);
  EXPECT_EQ(pixels[0].depth, 4.0f) << "the landmark, seen from the keyframe";
  EXPECT_EQ(pixels[1].depth, 2.0f);
  EXPECT_EQ(pixels[2].depth, 2.5f);
}

}  // namespace
}  // namespace photoslam
