// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// A webcam whose driver is played by the test.
#include "sources/webcam/webcam_source.h"

#include <gmock/gmock.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>

#include "io/image_file.h"
#include "sources/webcam/pixel_formats.h"

namespace photoslam {
namespace {

using internal::camera_device;
using testing::HasSubstr;

TEST(PixelFormats, YuyvIsBt601) {
  // Values of ITU-R BT.601 in video range: white, black, red, blue.
  const uint8_t bytes[] = {235, 128, 16, 128, 81, 90, 81, 240, 41, 240, 41, 110};
  const ImageU8 image = internal::yuyv_to_rgb(bytes, 6, 1, 12).value();
  const int expected[][3] = {{255, 255, 255}, {0, 0, 0}, {255, 0, 0}, {255, 0, 0}, {0, 0, 255}, {0, 0, 255}};
  for (int x = 0; x < 6; ++x) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image(x, 0, c), expected[x][c], 2) << x << " " << c;
  }
  EXPECT_FALSE(internal::yuyv_to_rgb(std::span(bytes).first(10), 6, 1, 12).ok());
}

TEST(PixelFormats, MotionJpegMayLackHuffmanTables) {
  const std::string whole = encode_jpeg(ImageU8(32, 16, 3, 90), 90).value();
  std::string bare;
  for (size_t i = 0; i < whole.size();) {
    if (whole[i] == '\xff' && i + 3 < whole.size() && whole[i + 1] == '\xc4') {
      i += 2 + (static_cast<uint8_t>(whole[i + 2]) << 8 | static_cast<uint8_t>(whole[i + 3]));  // a table segment
    } else {
      bare += whole[i++];
    }
  }
  ASSERT_LT(bare.size(), whole.size());
  const std::vector<uint8_t> bytes(bare.begin(), bare.end());
  const auto image = internal::decode_mjpeg(bytes);
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_NEAR((*image)(5, 5, 1), 90, 3);
  EXPECT_FALSE(internal::decode_mjpeg(std::vector<uint8_t>(100, 7)).ok());
}

TEST(Webcam, NamesOfDevices) {
  EXPECT_EQ(camera_device("camera:2"), "/dev/video2");
  EXPECT_EQ(camera_device("/dev/video0"), "/dev/video0");
  EXPECT_FALSE(camera_device("videos/kitchen").has_value());
}

/// A YUYV camera that delivers the given sequence numbers and is then unplugged.
class FakeCamera final : public internal::DeviceCalls {
 public:
  explicit FakeCamera(std::vector<uint32_t> sequence) : sequence_(std::move(sequence)) {}
  uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  int open_error = 0;
  uint32_t width = 640, height = 480;

  int open(const char*) override {
    errno = open_error;
    return open_error == 0 ? 3 : -1;
  }
  void close(int) override {}
  void* map(int, size_t length, int64_t) override {
    memory_.emplace_back(length, uint8_t{128});
    return memory_.back().data();
  }
  void unmap(void*, size_t) override {}
  int wait(int, int) override { return 1; }

  int ioctl(int, unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP: {
        auto& answer = *static_cast<v4l2_capability*>(argument);
        answer.capabilities = capabilities;
        std::memcpy(answer.card, "Fake", 5);
        return 0;
      }
      case VIDIOC_S_FMT: {
        auto& picture = static_cast<v4l2_format*>(argument)->fmt.pix;
        picture.pixelformat = V4L2_PIX_FMT_YUYV;
        picture.width = width;
        picture.height = height;
        picture.bytesperline = 2 * width;
        return 0;
      }
      case VIDIOC_QUERYBUF:
        static_cast<v4l2_buffer*>(argument)->length = 2 * width * height;
        return 0;
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      default:
        return 0;
    }
  }

 private:
  int dequeue(v4l2_buffer& buffer) {
    if (next_ == sequence_.size()) {
      errno = ENODEV;
      return -1;
    }
    buffer.index = static_cast<uint32_t>(next_ % 4);
    buffer.sequence = sequence_[next_++];
    buffer.bytesused = buffer.sequence == 2 ? 100 : 2 * width * height;
    buffer.timestamp.tv_sec = 100;
    buffer.timestamp.tv_usec = static_cast<long>(buffer.sequence) * 33'000;
    return 0;
  }

  std::vector<uint32_t> sequence_;
  size_t next_ = 0;
  std::vector<std::vector<uint8_t>> memory_;
};

TEST(Webcam, TellsWhatADeviceIs) {
  using internal::V4l2Device;
  EXPECT_EQ(V4l2Device::identify("/dev/video9", std::make_unique<FakeCamera>(std::vector<uint32_t>{})).value(), "Fake");
  auto metadata = std::make_unique<FakeCamera>(std::vector<uint32_t>{});
  metadata->capabilities = V4L2_CAP_STREAMING;
  EXPECT_THAT(V4l2Device::identify("/dev/video9", std::move(metadata)).error().message, HasSubstr("takes no pictures"));
  auto busy = std::make_unique<FakeCamera>(std::vector<uint32_t>{});
  busy->open_error = EBUSY;
  EXPECT_THAT(V4l2Device::identify("/dev/video9", std::move(busy)).error().message,
              HasSubstr("another program has it"));
}

TEST(Webcam, CountsDroppedFramesAndTellsOfDamage) {
  // Four frames at most, so that the queue loses none however slow this thread is.
  const auto source = internal::open_webcam("/dev/video9", {.fov_deg = 60},
                                            std::make_unique<FakeCamera>(std::vector<uint32_t>{1, 2, 6}))
                          .value();
  EXPECT_THAT(source->info().name, HasSubstr("Fake"));
  EXPECT_EQ(source->info().num_frames, 0);
  std::vector<Frame> frames;
  while (std::optional<Frame> frame = source->next()) frames.push_back(std::move(*frame));
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[0].defect, "");
  EXPECT_EQ(frames[0].timestamp_ns, 100'033'000'000);
  EXPECT_NEAR(frames[0].color(7, 7, 0), 130, 2);
  EXPECT_THAT(frames[1].defect, HasSubstr("a frame of 100 bytes"));
  EXPECT_EQ(frames[2].defect, "");
  EXPECT_EQ(frames[2].timestamp_ns, 100'198'000'000);
  EXPECT_THAT(frames[3].defect, HasSubstr("the camera is gone"));
  const int32_t ids[] = {0, 1, 5, 6};  // three were dropped
  for (size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].id, FrameId(ids[i]));
    if (i > 0) {
      EXPECT_GT(frames[i].timestamp_ns, frames[i - 1].timestamp_ns);
    }
  }
}

TEST(Webcam, ADriverThatCountsAnewHasDroppedNothing) {
  const auto source = internal::open_webcam("/dev/video9", {.fov_deg = 60},
                                            std::make_unique<FakeCamera>(std::vector<uint32_t>{7, 0, 3'000'000'000}))
                          .value();
  std::vector<int32_t> ids;
  int64_t last_ns = 0;
  while (const std::optional<Frame> frame = source->next()) {
    ids.push_back(frame->id.value);
    EXPECT_GT(frame->timestamp_ns, last_ns);
    last_ns = frame->timestamp_ns;
  }
  EXPECT_EQ(ids, (std::vector<int32_t>{0, 1, 2, 3}));
}

TEST(Webcam, ErrorsSayWhatToDo) {
  const auto failure = [](auto change) {
    auto camera = std::make_unique<FakeCamera>(std::vector<uint32_t>{});
    change(*camera);
    const auto source = internal::open_webcam("/dev/video9", {.fov_deg = 60}, std::move(camera));
    return source.ok() ? "no error" : source.error().message;
  };
  EXPECT_THAT(failure([](FakeCamera& c) { c.open_error = ENOENT; }), HasSubstr("is the camera plugged in?"));
  EXPECT_THAT(failure([](FakeCamera& c) { c.open_error = EACCES; }), HasSubstr("the group 'video'"));
  EXPECT_THAT(failure([](FakeCamera& c) { c.capabilities = V4L2_CAP_STREAMING; }), HasSubstr("takes no pictures"));
  EXPECT_THAT(failure([](FakeCamera& c) { c.width = 320; }), HasSubstr("offers 320x480 pixels"));
  EXPECT_THAT(open_source("camera:0").error().message, HasSubstr("/dev/video0 has no calibration"));
}

}  // namespace
}  // namespace photoslam
