// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/image_archive.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/random.h"

namespace photoslam {
namespace {

template <class T>
Image<T> random_image(int width, int height, int channels, Random& random) {
  Image<T> image(width, height, channels);
  for (T& value : image.values()) value = static_cast<T>(random.uniform(0, 1e5));
  return image;
}

template <class T>
void expect_same_after_reading(Image<T> image) {
  Archive writer;
  serialize_image(writer, image);
  Image<T> read;
  Archive reader(writer.bytes());
  serialize_image(reader, read);
  EXPECT_TRUE(reader.at_end());
  ASSERT_EQ(read.width(), image.width());
  ASSERT_EQ(read.height(), image.height());
  EXPECT_TRUE(std::ranges::equal(read.values(), image.values()));
}

TEST(ImageArchive, ReadsWhatItWrote) {
  Random random(1);
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {7, 1}, {13, 9}}) {
    expect_same_after_reading(random_image<uint16_t>(width, height, 1, random));
    expect_same_after_reading(random_image<float>(width, height, 1, random));
    Image<uint8_t> color(width, height, 3);
    for (uint8_t& value : color.values()) value = static_cast<uint8_t>(random.next());
    expect_same_after_reading(color);
  }
  expect_same_after_reading(ImageU8());
}

TEST(ImageArchive, ASmoothImageBecomesMostlyZero) {
  ImageU16 ramp(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) ramp(x, y) = static_cast<uint16_t>(1000 + 2 * x + 2 * y);
  }
  Archive writer;
  serialize_image(writer, ramp);
  const std::string& bytes = writer.bytes();
  EXPECT_GT(std::ranges::count(bytes.substr(bytes.size() / 2), '\0'), 64 * 48 - 100) << "the upper bytes";
}

}  // namespace
}  // namespace photoslam
