// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/fast.h"

#include <gtest/gtest.h>

#include "features/test_images.h"

namespace photoslam {
namespace {

constexpr int kCircleX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr int kCircleY[16] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

/// The definition, threshold by threshold: nine neighbours on the circle, all brighter or all darker by at least s.
bool is_corner(const ImageU8& image, int x, int y, int s) {
  for (int sign : {1, -1}) {
    for (int first = 0; first < 16; ++first) {
      bool all = true;
      for (int k = 0; k < 9; ++k) {
        const int i = (first + k) % 16;
        all &= sign * (image(x + kCircleX[i], y + kCircleY[i]) - image(x, y)) >= s;
      }
      if (all) return true;
    }
  }
  return false;
}

int score(const ImageU8& image, int x, int y) {
  int s = 0;
  while (s < 255 && is_corner(image, x, y, s + 1)) ++s;
  return s;
}

TEST(Fast, ScoresFollowTheDefinition) {
  // Rectangles give real corners, noise gives ties and small scores; odd sizes exercise the ends of the rows.
  for (const ImageU8& image :
       {RectangleScene(93, 61, 40, 1).render(93, 61, [](double&, double&) {}), random_image(71, 40, 2)}) {
    PaddedImage padded(image);
    std::vector<uint8_t> scores(static_cast<size_t>(image.width() + kRowPadding));
    for (int y = 3; y < image.height() - 3; ++y) {
      fast_score_row(padded.view(), y, 3, image.width() - 3, 7, scores.data());
      for (int x = 3; x < image.width() - 3; ++x) {
        const int expected = score(image, x, y);
        ASSERT_EQ(scores[static_cast<size_t>(x - 3)], expected > 7 ? expected : 0) << x << ", " << y;
      }
    }
  }
}

TEST(Fast, CornersAreTheLocalMaxima) {
  const ImageU8 image = RectangleScene(150, 90, 60, 3).render(150, 90, [](double&, double&) {});
  PaddedImage padded(image);
  std::vector<uint8_t> scratch;
  std::vector<Corner> corners;
  detect_fast(padded.view(), 4, 10, scratch, corners);
  ImageU8 found(150, 90);
  for (const Corner& corner : corners) {
    EXPECT_EQ(corner.score, score(image, corner.x, corner.y));
    found(corner.x, corner.y) = 1;
  }
  EXPECT_GT(corners.size(), 50u);
  for (int y = 4; y < 86; ++y) {
    for (int x = 4; x < 146; ++x) {
      const int own = score(image, x, y);
      bool maximum = own > 10;
      for (int v = -1; v <= 1 && maximum; ++v) {
        for (int u = -1; u <= 1; ++u) {
          const bool before = v < 0 || (v == 0 && u < 0);
          if (u == 0 && v == 0) continue;
          const int other = score(image, x + u, y + v);
          maximum &= before ? (own > other || other <= 10) : own >= other;
        }
      }
      EXPECT_EQ(found(x, y), maximum) << x << ", " << y;
    }
  }
}

TEST(Fast, FlatAndTinyImagesHaveNoCorners) {
  std::vector<uint8_t> scratch;
  std::vector<Corner> corners;
  PaddedImage flat(ImageU8(200, 100, 1, 77)), tiny(random_image(7, 7, 1));
  detect_fast(flat.view(), 4, 1, scratch, corners);
  detect_fast(tiny.view(), 4, 1, scratch, corners);
  EXPECT_TRUE(corners.empty());
}

}  // namespace
}  // namespace photoslam
