// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/stereo_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "features/test_images.h"

namespace photoslam {
namespace {

constexpr int kWidth = 480, kHeight = 360;
constexpr double kMaxDisparity = 60;

/// A slanted wall: disparity of a left pixel.
double true_disparity(double x, double y) { return 12 + 0.03 * x + 0.02 * y; }

/// Left pixel seen at a pixel of the right image.
double left_column(double x, double y) { return (x + 12 + 0.02 * y) / (1 - 0.03); }

struct Pair {
  ImageU8 left, right;
  Pair() {
    const RectangleScene scene(kWidth + 60, kHeight, 900, 3);
    left = scene.render(kWidth, kHeight, [](double&, double&) {});
    right = scene.render(kWidth, kHeight, [](double& x, double& y) { x = left_column(x, y); });
  }
};

struct Statistics {
  int features = 0, matches = 0, wrong = 0;
  double median_error = 0;  // [px of the keypoint's level]
};

Statistics match(const ImageU8& left_image, const ImageU8& right_image) {
  OrbExtractor extractor({.num_features = 600});
  Features features;
  extractor.extract(left_image, features);
  GreyPyramid left, right;
  left.build(left_image, 8, 1.2);
  right.build(right_image, 8, 1.2);
  std::vector<float> disparity;
  StereoMatcher matcher({});
  Statistics result;
  result.features = static_cast<int>(features.size());
  result.matches = matcher.match(left, features.keypoints, right, kMaxDisparity, disparity);
  std::vector<double> errors;
  for (size_t i = 0; i < features.size(); ++i) {
    if (std::isnan(disparity[i])) continue;
    const Keypoint& k = features.keypoints[i];
    const double error = std::abs(static_cast<double>(disparity[i]) - true_disparity(k.x, k.y));
    errors.push_back(error / std::pow(1.2, k.octave));
    result.wrong += errors.back() > 1;
  }
  EXPECT_EQ(static_cast<int>(errors.size()), result.matches);
  if (errors.empty()) return result;
  const auto middle = errors.begin() + static_cast<ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  result.median_error = *middle;
  return result;
}

TEST(StereoMatcher, FindsTheDisparityToAFractionOfAPixel) {
  const Pair pair;
  const Statistics s = match(pair.left, pair.right);
  EXPECT_GT(s.matches, 0.75 * s.features) << s.features;
  EXPECT_LE(s.wrong, 0.01 * s.matches);
  EXPECT_LT(s.median_error, 0.07);
}

TEST(StereoMatcher, ToleratesNoiseAndDifferentExposure) {
  Pair pair;
  Random random(5);
  for (uint8_t& v : pair.left.values()) v = static_cast<uint8_t>(std::clamp(v + 3 * random.normal(), 0.0, 255.0));
  for (uint8_t& v : pair.right.values()) {
    v = static_cast<uint8_t>(std::clamp(0.8 * v + 30 + 3 * random.normal(), 0.0, 255.0));
  }
  const Statistics s = match(pair.left, pair.right);
  EXPECT_GT(s.matches, 0.6 * s.features) << s.features;
  EXPECT_LE(s.wrong, 0.02 * s.matches);
  EXPECT_LT(s.median_error, 0.1);
}

TEST(StereoMatcher, WhatTheRightCameraDoesNotSeeHasNoMatch) {
  const Pair pair;
  const ImageU8 other = RectangleScene(kWidth + 60, kHeight, 900, 17).render(kWidth, kHeight, [](double&, double&) {});
  const Statistics s = match(pair.left, other);
  EXPECT_LE(s.matches, 0.02 * s.features) << s.features;
}

TEST(StereoMatcher, RepeatedPatternsAreAmbiguous) {
  ImageU8 checks(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) checks(x, y) = ((x / 12 + y / 12) % 2) != 0 ? 200 : 50;
  }
  const Statistics s = match(checks, checks);
  EXPECT_GT(s.features, 100);
  EXPECT_EQ(s.matches, 0);
}

}  // namespace
}  // namespace photoslam
