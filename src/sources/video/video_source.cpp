// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/video/video_source.h"

#include <array>

#include "base/check.h"
#include "base/module.h"
#include "sources/calibration/calibration.h"
#include "sources/sensor_choice.h"
#include "sources/video/video_plugin.h"

namespace photoslam::internal {
namespace {

namespace fs = std::filesystem;

Result<const PhotoslamVideoApi*> load_decoder() {
  const auto entry = find_in_module("photoslam_video.so", "photoslam_video_api");
  std::string why = entry ? "photoslam_video.so is of another version" : entry.error().message;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what a module exports is a function
  const PhotoslamVideoApi* const api = entry ? reinterpret_cast<PhotoslamVideoEntry>(*entry)() : nullptr;
  if (api != nullptr && api->version == kPhotoslamVideoApiVersion) return api;
  return error(
      "{}; build it with libavformat-dev, libavcodec-dev and libswscale-dev installed, or turn the video into images: "
      "ffmpeg -i VIDEO folder/%06d.png",
      why);
}

class VideoReader {
 public:
  static Result<std::unique_ptr<VideoReader>> open(const fs::path& file) {
    const auto api = load_decoder();
    if (!api) return api.error();
    auto reader = std::unique_ptr<VideoReader>(new VideoReader(**api));
    reader->handle_ = (*api)->open(file.c_str(), &reader->info_, reader->message_.data(), kMessageSize);
    if (reader->handle_ == nullptr) return error("{}: {}", file.string(), reader->message_.data());
    return reader;
  }
  ~VideoReader() {
    if (handle_ != nullptr) api_.close(handle_);
  }
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;

  const PhotoslamVideoInfo& info() const { return info_; }
  /// As in PhotoslamVideoApi; the image is of the stored size.
  int next(ImageU8& image, int64_t& time_ns) {
    image = ImageU8(info_.width, info_.height, 3);
    long long time = 0;
    const int result = api_.next(handle_, image.values().data(), &time, message_.data(), kMessageSize);
    time_ns = time;
    return result;
  }
  std::string message() const { return message_.data(); }

 private:
  static constexpr int kMessageSize = 512;
  explicit VideoReader(const PhotoslamVideoApi& api) : api_(api) {}

  const PhotoslamVideoApi& api_;
  void* handle_ = nullptr;
  PhotoslamVideoInfo info_{};
  std::array<char, kMessageSize> message_{};
};

class VideoSource final : public FrameSource {
 public:
  VideoSource(SourceInfo info, std::unique_ptr<VideoReader> reader)
      : info_(std::move(info)), reader_(std::move(reader)) {}

  const SourceInfo& info() const override { return info_; }

  std::optional<Frame> next() override {
    while (true) {
      Frame frame;
      ImageU8 image;
      const int result = reader_->next(image, frame.timestamp_ns);
      if (result == 0) return std::nullopt;
      if (result < 0) {
        frame.defect = fmt::format("{}: {}", info_.name, reader_->message());
        frame.timestamp_ns = last_ns_ ? *last_ns_ + 1 : 0;
      } else if (last_ns_ && frame.timestamp_ns <= *last_ns_) {
        continue;
      } else {
        frame.color = turned(image, reader_->info().clockwise_deg);
      }
      last_ns_ = frame.timestamp_ns;
      frame.id = FrameId(next_id_++);
      return frame;
    }
  }

 private:
  SourceInfo info_;
  std::unique_ptr<VideoReader> reader_;
  std::optional<int64_t> last_ns_;
  int32_t next_id_ = 0;
};

}  // namespace

ImageU8 turned(const ImageU8& image, int clockwise_deg) {
  PHOTOSLAM_CHECK(clockwise_deg % 90 == 0 && clockwise_deg >= 0 && clockwise_deg < 360, "{}°", clockwise_deg);
  if (clockwise_deg == 0) return image;
  const int w = image.width(), h = image.height(), channels = image.channels();
  const bool sideways = clockwise_deg != 180;
  ImageU8 out(sideways ? h : w, sideways ? w : h, channels);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const int u = clockwise_deg == 90 ? h - 1 - y : clockwise_deg == 180 ? w - 1 - x : y;
      const int v = clockwise_deg == 90 ? x : clockwise_deg == 180 ? h - 1 - y : w - 1 - x;
      for (int c = 0; c < channels; ++c) out(u, v, c) = image(x, y, c);
    }
  }
  return out;
}

Status check_decoder() {
  const auto decoder = load_decoder();
  return decoder ? Status{} : decoder.error();
}

Result<std::unique_ptr<FrameSource>> open_video(const fs::path& file, const SourceOptions& options) {
  SourceInfo info;
  info.format = "video";
  info.name = fmt::format("{} (video)", file.filename().string());
  constexpr std::array<SensorKind, 1> kAvailable = {SensorKind::mono};
  const Result<SensorKind> sensor = choose_sensor(options.sensor, kAvailable, info.name);
  if (!sensor) return sensor.error();
  info.sensor = *sensor;
  auto reader = VideoReader::open(file);
  if (!reader) return reader.error();
  const PhotoslamVideoInfo& stored = (*reader)->info();
  const bool sideways = stored.clockwise_deg % 180 != 0;
  const int width = sideways ? stored.height : stored.width, height = sideways ? stored.width : stored.height;
  const auto camera = chosen_camera(options.camera, options.fov_deg, width, height, info.notes);
  if (!camera) return camera.error();
  if (!*camera) {
    return error("{} has no calibration: name one with --camera FILE, or guess with --fov DEGREES (phones: about 70)",
                 file.string());
  }
  if (Status status = apply_camera(**camera, options.camera.string(), info); !status) return status.error();
  if (info.camera.width != width || info.camera.height != height) {
    return error("{} shows {}x{} pixels, but {} is calibrated for {}x{}", file.string(), width, height,
                 options.camera.string(), info.camera.width, info.camera.height);
  }
  if (stored.clockwise_deg != 0) {
    info.notes.push_back(fmt::format("the images are turned by {}° as the file asks", stored.clockwise_deg));
  }
  info.frames_per_second = stored.frames_per_second;
  info.num_frames = static_cast<int>(stored.num_frames);
  return std::unique_ptr<FrameSource>(std::make_unique<VideoSource>(std::move(info), std::move(*reader)));
}

}  // namespace photoslam::internal
