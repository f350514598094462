// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/brief.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "features/test_images.h"

namespace photoslam {
namespace {

TEST(BriefPattern, IsTheSameOnEveryMachine) {
  // FNV-1a over the tests. Descriptors are stored in map files: a change of the pattern makes old maps useless.
  uint64_t hash = 14695981039346656037ull;
  for (const BriefTest& t : make_brief_pattern()) {
    for (int8_t v : {t.ax, t.ay, t.bx, t.by}) hash = (hash ^ static_cast<uint8_t>(v)) * 1099511628211ull;
  }
  EXPECT_EQ(hash, 17270815970074943392ull);
}

TEST(BriefPattern, TestsAreDistinctAndInsideTheDisc) {
  std::set<std::array<int, 4>> seen;
  for (const BriefTest& t : make_brief_pattern()) {
    EXPECT_LE(t.ax * t.ax + t.ay * t.ay, kPatchRadius * kPatchRadius);
    EXPECT_LE(t.bx * t.bx + t.by * t.by, kPatchRadius * kPatchRadius);
    EXPECT_TRUE(seen.insert({t.ax, t.ay, t.bx, t.by}).second);
    EXPECT_FALSE(seen.contains({t.bx, t.by, t.ax, t.ay}));
  }
}

TEST(Orientation, AgreesWithTheCentroid) {
  const ImageU8 image = random_image(60, 50, 8);
  PaddedImage padded(image);
  for (int y = 15; y < 35; y += 3) {
    for (int x = 15; x < 45; x += 3) {
      double mx = 0, my = 0;
      for (int v = -15; v <= 15; ++v) {
        for (int u = -15; u <= 15; ++u) {
          if (u * u + v * v > 225) continue;
          mx += u * image(x + u, y + v);
          my += v * image(x + u, y + v);
        }
      }
      const double expected = std::atan2(my, mx);
      EXPECT_NEAR(intensity_centroid_angle(padded.view(), x, y),
                  expected < 0 ? expected + 2 * std::numbers::pi : expected, 1e-5);
    }
  }
}

TEST(Orientation, OfAFlatPatchIsZero) {
  PaddedImage flat(ImageU8(40, 40, 1, 90));
  EXPECT_EQ(intensity_centroid_angle(flat.view(), 20, 20), 0.0f);
}

TEST(BriefDescriber, TurnsWithThePatch) {
  // A quarter turn of an image is exact; the descriptor at the turned angle must not change at all.
  const ImageU8 image = random_image(41, 41, 9);
  ImageU8 turned(41, 41);
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) turned(40 - y, x) = image(x, y);
  }
  PaddedImage a(image), b(turned);
  BriefDescriber describer;
  const float quarter = static_cast<float>(std::numbers::pi / 2);
  EXPECT_EQ(describer.describe(a.view(), 20, 20, 0), describer.describe(b.view(), 20, 20, quarter));
  EXPECT_EQ(describer.describe(a.view(), 20, 20, quarter), describer.describe(b.view(), 20, 20, 2 * quarter));
}

TEST(BriefDescriber, BitsOfRandomPatchesAreBalanced) {
  PaddedImage image(random_image(300, 300, 10));
  BriefDescriber describer;
  int ones = 0, count = 0;
  for (int y = 20; y < 280; y += 10) {
    for (int x = 20; x < 280; x += 10, ++count) {
      ones += hamming_distance(describer.describe(image.view(), x, y, 0), Descriptor{});
    }
  }
  EXPECT_NEAR(ones / (256.0 * count), 0.5, 0.02);
}

}  // namespace
}  // namespace photoslam
