// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/convert.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"

namespace photoslam {
namespace {

TEST(ToGrey, IsBt601LumaRounded) {
  Random random(1);
  ImageU8 rgb(50, 40, 3);
  for (uint8_t& v : rgb.values()) v = static_cast<uint8_t>(random.next());
  const ImageU8 grey = to_grey(rgb);
  for (int y = 0; y < rgb.height(); ++y) {
    for (int x = 0; x < rgb.width(); ++x) {
      const double luma = 0.299 * rgb(x, y, 0) + 0.587 * rgb(x, y, 1) + 0.114 * rgb(x, y, 2);
      ASSERT_NEAR(grey(x, y), luma, 0.502);
    }
  }
  EXPECT_EQ(to_grey(ImageU8(1, 1, 3, 255))(0, 0), 255);
  EXPECT_EQ(to_grey(grey), grey);
}

TEST(ToRgb, KeepsEveryGreyLevel) {
  ImageU8 grey(256, 1);
  for (int x = 0; x < 256; ++x) grey(x, 0) = static_cast<uint8_t>(x);
  EXPECT_EQ(to_grey(to_rgb(grey)), grey);
}

TEST(ToFloat, AndBackIsTheIdentity) {
  ImageU8 levels(256, 1);
  for (int x = 0; x < 256; ++x) levels(x, 0) = static_cast<uint8_t>(x);
  const ImageF values = to_float(levels);
  EXPECT_EQ(values(0, 0), 0.0f);
  EXPECT_EQ(values(255, 0), 1.0f);
  EXPECT_EQ(to_u8(values), levels);
}

TEST(ToU8, ClampsAndRounds) {
  ImageF values(6, 1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  std::ranges::copy(std::initializer_list<float>{-3.0f, 1.5f, 0.4f / 255, 0.6f / 255, nan, infinity},
                    values.values().begin());
  const ImageU8 levels = to_u8(values);
  const std::initializer_list<int> expected = {0, 255, 0, 1, 0, 255};
  EXPECT_TRUE(std::ranges::equal(levels.values(), expected));
}

TEST(SampleBilinear, IsExactForALinearImage) {
  ImageU16 image(7, 5);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 7; ++x) image(x, y) = static_cast<uint16_t>(100 + 10 * x + 3 * y);
  }
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const auto x = static_cast<float>(random.uniform(0, 6)), y = static_cast<float>(random.uniform(0, 4));
    EXPECT_NEAR(sample_bilinear(image, x, y), 100 + 10 * x + 3 * y, 1e-4);
  }
  EXPECT_EQ(sample_bilinear(image, 6.0f, 4.0f), 172);
  EXPECT_EQ(sample_bilinear(ImageF(1, 1, 1, 0.5f), 0.0f, 0.0f), 0.5f);
}

}  // namespace
}  // namespace photoslam
