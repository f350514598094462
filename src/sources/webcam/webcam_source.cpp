// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/webcam/webcam_source.h"

#include <algorithm>
#include <array>
#include <thread>

#include "base/bounded_queue.h"
#include "sources/calibration/calibration.h"
#include "sources/sensor_choice.h"

namespace photoslam::internal {
namespace {

constexpr int kUsualWidth = 640, kUsualHeight = 480;
constexpr double kUsualRate = 30;
constexpr int kTimeout_ms = 3000;

class WebcamSource final : public FrameSource {
 public:
  WebcamSource(SourceInfo info, std::unique_ptr<V4l2Device> device)
      : info_(std::move(info)), device_(std::move(device)), queue_(kWaiting, Overflow::drop_oldest) {
    thread_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
  }
  ~WebcamSource() override {
    thread_.request_stop();
    queue_.close();
  }

  const SourceInfo& info() const override { return info_; }

  std::optional<Frame> next() override {
    if (!pending_) pending_ = queue_.pop();
    if (!pending_) return std::nullopt;
    Frame frame;
    if (!*pending_) {  // the end, and why
      frame.id = FrameId(next_id_++);
      frame.timestamp_ns = last_ns_ + 1;
      frame.defect = pending_->error().message;
      pending_.reset();
      return frame;
    }
    GrabbedFrame& grabbed = **pending_;
    const int32_t missing = num_missing(grabbed.sequence);
    frame.id = FrameId(next_id_ + missing);
    next_id_ = frame.id.value + 1;
    frame.timestamp_ns = std::max(grabbed.timestamp_ns, last_ns_ + missing + 1);  // every missing one has its time
    last_ns_ = frame.timestamp_ns;
    if (!grabbed.image) {
      frame.defect = grabbed.image.error().message;
    } else if (grabbed.image->width() != info_.camera.width || grabbed.image->height() != info_.camera.height) {
      frame.defect = "a picture of another size";
    } else {
      frame.color = std::move(*grabbed.image);
    }
    pending_.reset();
    return frame;
  }

 private:
  static constexpr size_t kWaiting = 4;

  /// Frames between the last one and this.
  int32_t num_missing(uint32_t sequence) {
    constexpr uint32_t kMost = 100'000;  // nearly an hour: a larger step means that the driver counts anew
    const uint32_t missing = last_sequence_ ? sequence - *last_sequence_ - 1 : 0;
    last_sequence_ = sequence;
    return missing <= kMost ? static_cast<int32_t>(missing) : 0;
  }

  void read(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      Result<GrabbedFrame> frame = device_->grab(kTimeout_ms);
      const bool ok = frame.ok();
      if (!queue_.push(std::move(frame)) || !ok) break;
    }
    queue_.close();
  }

  SourceInfo info_;
  std::unique_ptr<V4l2Device> device_;
  BoundedQueue<Result<GrabbedFrame>> queue_;
  std::optional<Result<GrabbedFrame>> pending_;
  std::optional<uint32_t> last_sequence_;
  int64_t last_ns_ = -1;
  int32_t next_id_ = 0;
  std::jthread thread_;  // last: stops before what it uses goes
};

}  // namespace

std::optional<std::string> camera_device(const std::string& name) {
  constexpr std::string_view kPrefix = "camera:";
  if (name.starts_with("/dev/video")) return name;
  if (!name.starts_with(kPrefix)) return std::nullopt;
  return "/dev/video" + name.substr(kPrefix.size());
}

Result<std::unique_ptr<FrameSource>> open_webcam(const std::string& path, const SourceOptions& options,
                                                 std::unique_ptr<DeviceCalls> calls) {
  SourceInfo info;
  info.format = "camera";
  constexpr std::array<SensorKind, 1> kAvailable = {SensorKind::mono};
  const Result<SensorKind> sensor = choose_sensor(options.sensor, kAvailable, path);
  if (!sensor) return sensor.error();
  info.sensor = *sensor;
  // The calibration tells which picture size is wanted.
  const auto camera = chosen_camera(options.camera, options.fov_deg, kUsualWidth, kUsualHeight, info.notes);
  if (!camera) return camera.error();
  if (!*camera) {
    return error("{} has no calibration: name one with --camera FILE, or guess with --fov DEGREES (webcams: about 60)",
                 path);
  }
  info.name = path;
  if (Status status = apply_camera(**camera, options.camera.string(), info); !status) return status.error();
  const double rate =
      options.frames_per_second > 0 ? options.frames_per_second : (*camera)->frames_per_second.value_or(kUsualRate);
  auto device = V4l2Device::open(path, info.camera.width, info.camera.height, rate, std::move(calls));
  if (!device) return device.error();
  if ((*device)->width() != info.camera.width || (*device)->height() != info.camera.height) {
    return error("{} offers {}x{} pixels, but {} is for {}x{}", path, (*device)->width(), (*device)->height(),
                 options.camera.empty() ? "the guess" : options.camera.string(), info.camera.width, info.camera.height);
  }
  info.name = fmt::format("{} ({})", (*device)->name(), path);
  info.frames_per_second = (*device)->frames_per_second() > 0 ? (*device)->frames_per_second() : rate;
  return std::unique_ptr<FrameSource>(std::make_unique<WebcamSource>(std::move(info), std::move(*device)));
}

}  // namespace photoslam::internal
