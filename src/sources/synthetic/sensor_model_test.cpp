// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/sensor_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace photoslam {
namespace {

/// A grey wall straight ahead.
SceneView wall(int width, int height, float radiance, float depth) {
  return {ImageF(width, height, 3, radiance), ImageF(width, height, 1, depth), ImageF(width, height, 1, 1.0f)};
}

struct Moments {
  double mean = 0, deviation = 0;
};
template <class Values>
Moments moments(const Values& values) {
  Moments m;
  double square = 0;
  for (const auto v : values) m.mean += v / static_cast<double>(values.size());
  for (const auto v : values) square += (v - m.mean) * (v - m.mean) / static_cast<double>(values.size());
  m.deviation = std::sqrt(square);
  return m;
}

TEST(SensorModel, ExposureKeepsMiddleGreyAndRises) {
  // 18 % grey is 118 in sRGB.
  EXPECT_NEAR(expose(wall(4, 4, 0.18f, 1), 0, 0, 0)(0, 0), 118, 1);
  EXPECT_EQ(expose(wall(4, 4, 0, 1), 0, 0, 0)(0, 0), 0);
  int before = -1;
  for (float light : {0.01f, 0.05f, 0.2f, 0.5f, 0.8f, 1.5f, 3.0f}) {
    const int value = expose(wall(4, 4, light, 1), 0, 0, 0)(0, 0);
    EXPECT_GT(value, before) << light;
    before = value;
  }
  EXPECT_GT(before, 250);
  EXPECT_EQ(expose(wall(4, 4, 0.1f, 1), 1.0, 0, 0), expose(wall(4, 4, 0.2f, 1), 0, 0, 0));
}

TEST(SensorModel, ImageNoiseHasTheStatedDeviation) {
  const ImageU8 noisy = expose(wall(200, 150, 0.18f, 1), 0, 3.0, 42);
  const Moments m = moments(noisy.values());
  EXPECT_NEAR(m.mean, 118, 0.6);
  EXPECT_NEAR(m.deviation, 3.0, 0.1);
  EXPECT_EQ(noisy, expose(wall(200, 150, 0.18f, 1), 0, 3.0, 42));
  EXPECT_NE(noisy, expose(wall(200, 150, 0.18f, 1), 0, 3.0, 43));
}

TEST(SensorModel, DepthNoiseGrowsWithTheSquareOfTheDepth) {
  constexpr double kUnit = 1e-4;
  for (const auto& [depth, deviation] : {std::pair{1.0f, 0.002}, {2.0f, 0.008}, {3.0f, 0.018}}) {
    const ImageU16 measured = measure_depth(wall(200, 150, 0.2f, depth), kUnit, 0.002, 1.0, 7);
    const Moments m = moments(measured.values());
    EXPECT_NEAR(m.mean * kUnit, depth, 1e-3);
    EXPECT_NEAR(m.deviation * kUnit, deviation, 0.03 * deviation);
  }
}

TEST(SensorModel, WithoutNoiseDepthIsRoundedToUnits) {
  EXPECT_EQ(measure_depth(wall(3, 3, 0.2f, 1.23456f), 1.0 / 5000, 0, 0, 1)(1, 1), 6173);
  EXPECT_EQ(measure_depth(wall(3, 3, 0.2f, 20.0f), 1.0 / 5000, 0, 0, 1)(1, 1), 0);  // more than 16 bits hold
  EXPECT_EQ(measure_depth(wall(3, 3, 0.2f, 0.0f), 1.0 / 5000, 0, 0, 1)(1, 1), 0);
}

TEST(SensorModel, HolesAreAtEdgesAndGrazingSurfaces) {
  SceneView view = wall(100, 80, 0.2f, 2.0f);
  for (int y = 0; y < 80; ++y) {
    for (int x = 50; x < 100; ++x) view.depth(x, y) = 3.0f;
    view.incidence(10, y) = 0.05f;
  }
  int holes = 0;
  const ImageU16 measured = measure_depth(view, 1e-4, 0, 0.5, 11);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 100; ++x) {
      if (measured(x, y) != 0) continue;
      EXPECT_TRUE(x == 10 || x == 49 || x == 50) << x;
      ++holes;
    }
  }
  EXPECT_NEAR(holes, 0.5 * 3 * 80, 30);
}

}  // namespace
}  // namespace photoslam
