// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/image_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/random.h"
#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::HasSubstr;

template <class T>
Image<T> random_image(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  Image<T> image(width, height, channels);
  for (T& v : image.values()) v = static_cast<T>(random.next());
  return image;
}

/// A picture without sharp edges, so that JPEG loses little.
ImageU8 smooth_image(int width, int height, int channels) {
  ImageU8 image(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        image(x, y, c) = static_cast<uint8_t>(128 + 60 * std::sin(0.07 * x + c) + 50 * std::cos(0.05 * y - 2 * c));
      }
    }
  }
  return image;
}

class ImageFileTest : public TempFolderTest {};

TEST_F(ImageFileTest, PngIsLossless) {
  for (const int channels : {1, 3}) {
    for (const int compression : {0, 3, 9}) {
      const ImageU8 image = random_image<uint8_t>(37, 21, channels, 1);
      ASSERT_TRUE(write_png(folder / "a.png", image, compression).ok());
      EXPECT_EQ(read_image(folder / "a.png").value(), image);
    }
  }
  const ImageU16 depth = random_image<uint16_t>(64, 48, 1, 2);
  ASSERT_TRUE(write_png(folder / "d.png", depth).ok());
  EXPECT_EQ(read_depth_png(folder / "d.png").value(), depth);
}

TEST_F(ImageFileTest, SixteenBitsAreStoredBigEndianAsThePngStandardSays) {
  ImageU16 depth(1, 1);
  depth(0, 0) = 0x1234;
  ASSERT_TRUE(write_png(folder / "d.png", depth, 0).ok());
  // An uncompressed row: filter byte 0, then the value, most significant byte first.
  EXPECT_THAT(read_file(folder / "d.png").value(), HasSubstr(std::string("\x00\x12\x34", 3)));
}

TEST_F(ImageFileTest, JpegKeepsTheLookOfGreyAndColour) {
  for (const int channels : {1, 3}) {
    const ImageU8 image = smooth_image(101, 67, channels);
    ASSERT_TRUE(write_jpeg(folder / "a.jpg", image, 95).ok());
    const ImageU8 back = read_image(folder / "a.jpg").value();
    ASSERT_TRUE(back.same_size(image));
    ASSERT_EQ(back.channels(), channels);
    for (size_t i = 0; i < image.values().size(); ++i) {
      ASSERT_NEAR(back.values()[i], image.values()[i], 6) << i;
    }
  }
}

TEST_F(ImageFileTest, TheContentDecidesNotTheName) {
  const ImageU8 image = smooth_image(16, 16, 3);
  ASSERT_TRUE(write_png(folder / "png.jpg", image).ok());
  EXPECT_EQ(read_image(folder / "png.jpg").value(), image);
}

TEST_F(ImageFileTest, TruncationAnywhereIsAnErrorThatNamesTheFile) {
  ASSERT_TRUE(write_png(folder / "a.png", smooth_image(40, 30, 3)).ok());
  ASSERT_TRUE(write_png(folder / "d.png", random_image<uint16_t>(40, 30, 1, 3)).ok());
  ASSERT_TRUE(write_jpeg(folder / "a.jpg", smooth_image(40, 30, 3)).ok());
  for (const char* name : {"a.png", "d.png", "a.jpg"}) {
    const std::string content = read_file(folder / name).value();
    for (const size_t size : {content.size() / 10, content.size() / 2, content.size() - 9}) {
      const auto cut = write(fmt::format("cut_{}", name), content.substr(0, size));
      const std::string message = name == std::string("d.png") ? read_depth_png(cut).error().message  //
                                                               : read_image(cut).error().message;
      EXPECT_THAT(message, HasSubstr("cut_")) << size;
      EXPECT_THAT(message, HasSubstr("damaged")) << size;
    }
  }
}

TEST_F(ImageFileTest, ErrorsSayWhatIsWrong) {
  write("zero.png", "");
  write("text.png", "rgb and depth");
  ASSERT_TRUE(write_png(folder / "rgb.png", smooth_image(8, 8, 3)).ok());
  ASSERT_TRUE(write_jpeg(folder / "rgb.jpg", smooth_image(8, 8, 3)).ok());
  EXPECT_THAT(read_image(folder / "zero.png").error().message, HasSubstr("zero.png is empty (0 bytes)"));
  EXPECT_THAT(read_depth_png(folder / "zero.png").error().message, HasSubstr("zero.png is empty (0 bytes)"));
  EXPECT_THAT(read_image(folder / "text.png").error().message, HasSubstr("text.png is neither a PNG nor a JPEG"));
  EXPECT_THAT(read_image(folder / "absent.png").error().message, HasSubstr("absent.png"));
  EXPECT_THAT(read_depth_png(folder / "rgb.png").error().message, HasSubstr("one channel of 16 bits, found 3 of 8"));
  EXPECT_THAT(read_depth_png(folder / "rgb.jpg").error().message, HasSubstr("is not a PNG image"));
}

TEST_F(ImageFileTest, AnAbsurdSizeInTheHeaderIsRefusedBeforeMemoryIsTaken) {
  ASSERT_TRUE(write_jpeg(folder / "a.jpg", smooth_image(8, 8, 3)).ok());
  std::string content = read_file(folder / "a.jpg").value();
  const size_t start_of_frame = content.find("\xff\xc0");
  ASSERT_NE(start_of_frame, std::string::npos);
  for (size_t i = 5; i < 9; ++i) content[start_of_frame + i] = '\xfe';
  EXPECT_THAT(read_image(write("huge.jpg", content)).error().message, HasSubstr("65278x65278"));
}

TEST_F(ImageFileTest, AFailedWriteIsAnError) {
  EXPECT_FALSE(write_png(folder / "absent" / "a.png", smooth_image(8, 8, 3)).ok());
  EXPECT_FALSE(write_jpeg(folder / "absent" / "a.jpg", smooth_image(8, 8, 3)).ok());
}

}  // namespace
}  // namespace photoslam
