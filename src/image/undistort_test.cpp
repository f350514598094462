// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/undistort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {.width = 320, .height = 240, .fx = 258.65, .fy = 258.23, .cx = 159.1, .cy = 127.4};
constexpr Distortion kDistortion = {.k1 = 0.262383, .k2 = -0.953104, .p1 = -0.005358, .p2 = 0.002628, .k3 = 1.163314};

/// A smooth picture on the plane z = 1, seen by the lens or by an ideal camera.
template <class T>
Image<T> photograph(bool through_lens) {
  Image<T> image(kCamera.width, kCamera.height);
  for (int y = 0; y < kCamera.height; ++y) {
    for (int x = 0; x < kCamera.width; ++x) {
      const Vec2 seen((x - kCamera.cx) / kCamera.fx, (y - kCamera.cy) / kCamera.fy);
      const Vec2 ray = through_lens ? undistort(kDistortion, seen).value_or(Vec2(0, 0)) : seen;
      image(x, y) = static_cast<T>(128.5 + 60 * std::sin(9 * ray.x()) + 50 * std::cos(7 * ray.y() + 1));
    }
  }
  return image;
}

TEST(Undistorter, GivesWhatAnIdealCameraSees) {
  const Undistorter undistorter(kCamera, kDistortion);
  EXPECT_EQ(undistorter.camera(), kCamera);
  const ImageU8 ideal = photograph<uint8_t>(false);
  const ImageU8 result = undistorter.color(photograph<uint8_t>(true));
  const ImageU16 depth = undistorter.depth(photograph<uint16_t>(true));
  int compared = 0;
  for (int y = 0; y < kCamera.height; ++y) {
    for (int x = 0; x < kCamera.width; ++x) {
      if (undistorter.mask()(x, y) == 0) {
        ASSERT_EQ(result(x, y), 0);
        ASSERT_EQ(depth(x, y), 0);
        continue;
      }
      ASSERT_NEAR(result(x, y), ideal(x, y), 2) << x << " " << y;
      ASSERT_NEAR(depth(x, y), ideal(x, y), 4) << x << " " << y;  // half a pixel of slope
      ++compared;
    }
  }
  EXPECT_GT(compared, 70000);
}

TEST(Undistorter, WithoutDistortionChangesNothing) {
  const Undistorter undistorter(kCamera, {});
  const ImageU8 image = photograph<uint8_t>(false);
  EXPECT_EQ(undistorter.color(image), image);
  const auto mask = undistorter.mask().values();
  EXPECT_TRUE(std::ranges::all_of(mask, [](uint8_t m) { return m == 255; }));
}

TEST(Undistorter, MasksWhatTheLensDidNotSee) {
  // A pincushion lens squeezes less of the world into its image than the ideal camera would see at the corners.
  const Undistorter pincushion(kCamera, {.k1 = 0.5});
  EXPECT_EQ(pincushion.mask()(0, 0), 0);
  EXPECT_EQ(pincushion.mask()(160, 120), 255);
  // A barrel polynomial folds back beyond r = 1 / sqrt(3 * 2.5) = 0.37: those rays are not data.
  const Undistorter folding(kCamera, {.k1 = -2.5});
  EXPECT_EQ(folding.mask()(static_cast<int>(kCamera.cx + 0.33 * kCamera.fx), 127), 255);
  EXPECT_EQ(folding.mask()(static_cast<int>(kCamera.cx + 0.42 * kCamera.fx), 127), 0);
}

}  // namespace
}  // namespace photoslam
