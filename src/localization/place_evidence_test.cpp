// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/place_evidence.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

constexpr int kWidth = 640, kHeight = 480, kCell = 80;  // 8 x 6 cells

/// Keypoints in the middle of every cell, `count` in each.
Features everywhere(int count) {
  Features features;
  for (int y = kCell / 2; y < kHeight; y += kCell) {
    for (int x = kCell / 2; x < kWidth; x += kCell) {
      for (int i = 0; i < count; ++i) {
        Keypoint& keypoint = features.keypoints.emplace_back();
        keypoint.x = static_cast<float>(x);
        keypoint.y = static_cast<float>(y);
      }
    }
  }
  return features;
}

/// Expects `expected` landmarks in every cell, and finds `found` of them in each of the first `columns` columns.
PlaceEvidence evidence(const Features& features, int expected, int found, int columns) {
  PlaceEvidence result(kWidth, kHeight, features);
  for (int y = 1; y < kHeight; y += kCell) {
    for (int x = 1; x < kWidth; x += kCell) {
      for (int i = 0; i < expected; ++i) result.expect(static_cast<float>(x), static_cast<float>(y));
      if (x >= columns * kCell) continue;
      for (int i = 0; i < found; ++i) result.find(static_cast<float>(x), static_cast<float>(y));
    }
  }
  return result;
}

TEST(PlaceEvidence, OfLandmarksMadeAnewInEveryKeyframeOnlyTheKeypointsCanBeFound) {
  EXPECT_EQ(evidence(everywhere(20), 10, 4, 8).findable(), 480);
  EXPECT_EQ(evidence(everywhere(6), 10, 4, 8).findable(), 288);
  EXPECT_EQ(evidence(everywhere(6), 10, 4, 8).found(), 192);
}

TEST(PlaceEvidence, CoverageIsTheShareOfTheImageInWhichSomeWereFound) {
  EXPECT_DOUBLE_EQ(evidence(everywhere(20), 10, 4, 8).coverage(), 1);
  EXPECT_DOUBLE_EQ(evidence(everywhere(20), 10, 10, 2).coverage(), 0.25);
  EXPECT_DOUBLE_EQ(evidence(everywhere(20), 10, 1, 8).coverage(), 0) << "one of ten is chance";
  EXPECT_DOUBLE_EQ(evidence(everywhere(20), 2, 2, 8).coverage(), 0) << "of two nothing can be said";
}

TEST(PlaceEvidence, SufficesTwoDeviationsAboveTheShareOfWhatLooksAlike) {
  // 480 findable: a quarter is 120, its deviation √(480 · 1/4 · 3/4) = 9.49; more than 138.97 are asked for.
  for (const auto& [found, suffices] : {std::pair(138, false), std::pair(139, true)}) {
    PlaceEvidence some = evidence(everywhere(20), 10, 2, 8);  // 96, all over the image
    for (int i = some.found(); i < found; ++i) some.find(5, 5);
    EXPECT_EQ(some.suffices({.min_matched_share = 0.25, .min_coverage = 0.5}), suffices) << found;
  }
}

TEST(PlaceEvidence, ThingsThatLookAlikeInOneHalfDoNotSuffice) {
  const Features features = everywhere(20);
  EXPECT_FALSE(evidence(features, 10, 10, 3).suffices({.min_matched_share = 0.25, .min_coverage = 0.5}));
  EXPECT_TRUE(evidence(features, 10, 10, 4).suffices({.min_matched_share = 0.25, .min_coverage = 0.5}));
}

}  // namespace
}  // namespace photoslam
