// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/video/video_source.h"

#include <gmock/gmock.h>

#include "io/image_file.h"
#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::HasSubstr;

TEST(TurnedImage, PutsTheCornersWhereTheyBelong) {
  ImageU8 image(3, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) image(x, y) = static_cast<uint8_t>(10 * y + x);
  }
  const ImageU8 right = internal::turned(image, 90);
  EXPECT_EQ(right.width(), 2);
  EXPECT_EQ(right(1, 0), 0);   // the upper left corner goes to the upper right
  EXPECT_EQ(right(0, 0), 10);  // the lower left one to the upper left
  EXPECT_EQ(right(1, 2), 2);
  EXPECT_EQ(internal::turned(right, 90), internal::turned(image, 180));
  EXPECT_EQ(internal::turned(internal::turned(image, 270), 90), image);
}

class VideoTest : public TempFolderTest {
 protected:
  /// Motion JPEG without a container: the decoder takes 25 frames per second.
  std::filesystem::path write_video(int frames, size_t cut = 0) const {
    std::string content;
    for (int i = 0; i < frames; ++i) {
      content += encode_jpeg(ImageU8(64, 48, 3, static_cast<uint8_t>(20 * i)), 95).value();
    }
    return write("video.mjpeg", content.substr(0, content.size() - cut));
  }
};

TEST_F(VideoTest, TheFormatMayBeNamed) {
  const auto path = write_video(2);
  const auto guessed = open_source(path, {.fov_deg = 60}),
             named = open_source(path, {.format = "video", .fov_deg = 60});
  EXPECT_EQ(check_video_support().ok(), guessed.ok());
  ASSERT_EQ(named.ok(), guessed.ok());
  if (named) {
    EXPECT_EQ((*named)->info().format, "video");
  } else {
    EXPECT_EQ(named.error().message, guessed.error().message);
  }
  EXPECT_THAT(open_source(path, {.format = "images"}).error().message, HasSubstr("is a file; a dataset is a folder"));
  EXPECT_THAT(open_source(folder, {.format = "video"}).error().message, HasSubstr("is a folder; a video is a file"));
  EXPECT_THAT(open_source("camera:7", {.format = "video"}).error().message, HasSubstr("camera:7 is a live camera"));
}

TEST_F(VideoTest, ReadsFramesAndTimes) {
  const auto opened = open_source(write_video(6), {.fov_deg = 60});
  if (!opened && opened.error().message.find("photoslam_video.so") != std::string::npos) {
    GTEST_SKIP() << opened.error().message;
  }
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const SourceInfo& info = (*opened)->info();
  EXPECT_EQ(info.format, "video");
  EXPECT_EQ(info.camera.width, 64);
  EXPECT_EQ(info.sensor, SensorKind::mono);
  EXPECT_NEAR(info.frames_per_second, 25, 1e-6);
  for (int i = 0; i < 6; ++i) {
    const std::optional<Frame> frame = (*opened)->next();
    ASSERT_TRUE(frame.has_value()) << i;
    EXPECT_EQ(frame->defect, "");
    EXPECT_EQ(frame->id, FrameId(i));
    EXPECT_EQ(frame->timestamp_ns, i * 40'000'000);
    EXPECT_NEAR(frame->color(30, 20, 1), 20 * i, 4);
  }
  EXPECT_FALSE((*opened)->next().has_value());
}

TEST_F(VideoTest, DamagedFilesAreErrorsOrDefects) {
  const auto whole = open_source(write_video(3), {.fov_deg = 60});
  if (!whole) GTEST_SKIP() << whole.error().message;
  const auto half = open_source(write_video(3, 300), {.fov_deg = 60});
  if (half) {
    int frames = 0;
    while ((*half)->next()) ++frames;
    EXPECT_GE(frames, 2);
  }
  EXPECT_FALSE(open_source(write("noise.mp4", "this is no video"), {.fov_deg = 60}).ok());
  EXPECT_THAT(open_source(write_video(3)).error().message, HasSubstr("has no calibration"));
  EXPECT_THAT(open_source(write_video(3), {.fov_deg = 60, .sensor = SensorKind::stereo}).error().message,
              HasSubstr("can be read as mono"));
}

}  // namespace
}  // namespace photoslam
