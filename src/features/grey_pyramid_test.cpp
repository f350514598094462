// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/grey_pyramid.h"

#include <gtest/gtest.h>

#include "features/test_images.h"

namespace photoslam {
namespace {

TEST(GreyPyramid, KeepsAStraightEdgeWhereItIs) {
  // The edge x + y/2 = 150, a ramp wide enough for every level: at each level the place where the grey level crosses
  // 128 must map back onto it.
  constexpr double kScale = 1.2;
  ImageU8 image(320, 240);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      image(x, y) = static_cast<uint8_t>(std::lround(std::clamp(128 + 4 * (x + 0.5 * y - 150), 0.0, 255.0)));
    }
  }
  GreyPyramid pyramid;
  pyramid.build(image, 6, kScale);
  ASSERT_EQ(pyramid.num_levels(), 6);
  for (int i = 0; i < 6; ++i) {
    const GreyView level = pyramid.level(i);
    const double scale = pyramid.scale(i);
    EXPECT_NEAR(scale, std::pow(kScale, i), 1e-12);
    for (int y = 5; y < level.height - 5; y += 7) {
      int x = 1;
      while (x < level.width && *level.at(x, y) < 128) ++x;
      if (x < 5 || x >= level.width - 5) continue;
      const double a = *level.at(x - 1, y), b = *level.at(x, y);
      const double crossing = x - 1 + (128 - a) / (b - a);
      const double full_x = (crossing + 0.5) * scale - 0.5, full_y = (y + 0.5) * scale - 0.5;
      EXPECT_NEAR(full_x + 0.5 * full_y, 150, 0.3) << "level " << i;
    }
  }
}

TEST(GreyPyramid, AgreesWithBilinearInterpolation) {
  const ImageU8 image = random_image(133, 97, 4);
  GreyPyramid pyramid;
  pyramid.build(image, 2, 1.37);
  const GreyView level = pyramid.level(1);
  ASSERT_EQ(level.width, static_cast<int>(133 / 1.37));
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      const double sx = (x + 0.5) * 1.37 - 0.5, sy = (y + 0.5) * 1.37 - 0.5;
      const int ix = static_cast<int>(sx), iy = static_cast<int>(sy);
      const double fx = sx - ix, fy = sy - iy;
      const double expected = (1 - fy) * ((1 - fx) * image(ix, iy) + fx * image(ix + 1, iy)) +
                              fy * ((1 - fx) * image(ix, iy + 1) + fx * image(ix + 1, iy + 1));
      // Weights are rounded to 1/128: two axes, differences up to 255.
      EXPECT_NEAR(*level.at(x, y), expected, 0.5 + 2 * 255.0 / 256) << x << ", " << y;
    }
  }
}

TEST(Blur, AgreesWithTheGaussian) {
  PaddedImage source(random_image(101, 53, 5)), target(ImageU8(101, 53));
  std::vector<uint8_t> scratch;
  blur(source.view(), target.view(), scratch);
  double weights[7], total = 0;
  for (int k = 0; k < 7; ++k) total += weights[k] = std::exp(-(k - 3) * (k - 3) / 8.0);
  const auto clamped = [&](int x, int y) { return *source.view().at(std::clamp(x, 0, 100), std::clamp(y, 0, 52)); };
  for (int y = 0; y < 53; ++y) {
    for (int x = 0; x < 101; ++x) {
      double expected = 0;
      for (int v = 0; v < 7; ++v) {
        for (int u = 0; u < 7; ++u) expected += weights[u] * weights[v] * clamped(x + u - 3, y + v - 3);
      }
      EXPECT_NEAR(*target.view().at(x, y), expected / (total * total), 2) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace photoslam
