// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/resize.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "image/pyramid.h"

namespace photoslam {
namespace {

TEST(Resize, HalvingIsTheBlockMeanAndItsCamera) {
  Random random(1);
  ImageU8 image(32, 20, 3);
  for (uint8_t& value : image.values()) value = static_cast<uint8_t>(random.index(256));
  const ImageU8 half = resize(image, 16, 10), blocks = shrink_color(image, 2);
  for (size_t i = 0; i < half.values().size(); ++i) EXPECT_NEAR(half.values()[i], blocks.values()[i], 1);
  const PinholeCamera camera{32, 20, 30, 31, 15.2, 9.7};
  EXPECT_EQ(resize(camera, 16, 10), shrink(camera, 2));
}

TEST(Resize, TheSameSizeChangesNothing) {
  const ImageU8 image(5, 4, 1, 77);
  EXPECT_EQ(resize(image, 5, 4), image);
}

}  // namespace
}  // namespace photoslam
