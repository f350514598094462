// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/detail.h"

#include <gtest/gtest.h>

#include <cmath>

namespace photoslam {
namespace {

/// Vertical stripes of the given width in pixels, alternating between 128 − a and 128 + a.
ImageU8 stripes(int stripe_width, int a) {
  ImageU8 image(64, 48, 3);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c)
        image(x, y, c) = static_cast<uint8_t>((x / stripe_width) % 2 == 0 ? 128 - a : 128 + a);
    }
  }
  return image;
}

TEST(Detail, FineStripesAreLostAltogether) {
  // Every block of 8 pixels averages to 128, so the error is the amplitude everywhere.
  const DetailFigures figures = measure_detail(stripes(1, 20));
  EXPECT_NEAR(figures.shrunk_psnr_db, 20 * std::log10(255.0 / 20), 1e-4);
  EXPECT_NEAR(figures.horizontal_difference, 40, 1e-9);
}

TEST(Detail, PlainAndSlowlyChangingImagesHaveNone) {
  EXPECT_GT(measure_detail(ImageU8(64, 48, 3, 77)).shrunk_psnr_db, 90);
  EXPECT_EQ(measure_detail(ImageU8(64, 48, 3, 77)).horizontal_difference, 0);
  ImageU8 ramp(256, 32, 3);
  for (int y = 0; y < 32; ++y) {
    for (int i = 0; i < 256 * 3; ++i) ramp.row(y)[i] = static_cast<uint8_t>(i / 3);
  }
  EXPECT_GT(measure_detail(ramp).shrunk_psnr_db, 40);
  EXPECT_NEAR(measure_detail(ramp).horizontal_difference, 1, 1e-9);
}

}  // namespace
}  // namespace photoslam
