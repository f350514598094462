// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"

namespace photoslam::internal {

/// The system calls of a video device; a test puts its own in their place. They return -1 and set errno as usual.
class DeviceCalls {
 public:
  virtual ~DeviceCalls() = default;
  virtual int open(const char* path) = 0;
  virtual void close(int file) = 0;
  virtual int ioctl(int file, unsigned long request, void* argument) = 0;
  virtual void* map(int file, size_t length, int64_t offset) = 0;  ///< Null on failure.
  virtual void unmap(void* memory, size_t length) = 0;
  /// Waits until a frame is there: 1, 0 after `timeout_ms`, -1 on failure.
  virtual int wait(int file, int timeout_ms) = 0;
};
std::unique_ptr<DeviceCalls> system_device_calls();

/// A frame as the driver handed it over.
struct GrabbedFrame {
  uint32_t sequence = 0;     ///< The driver counts frames that it had to drop, too.
  int64_t timestamp_ns = 0;  ///< Of the kernel, on its monotonic clock.
  Result<ImageU8> image = ImageU8{};
};

/// A streaming Video4Linux2 camera: motion JPEG where it has it (more frames per second over USB), else YUYV.
class V4l2Device {
 public:
  /// Errors say what the device is not, or who has it.
  static Result<std::unique_ptr<V4l2Device>> open(const std::string& path, int width, int height, double fps,
                                                  std::unique_ptr<DeviceCalls> calls);
  /// The name of the camera, which is opened and left as it is; the error says what the device is not.
  static Result<std::string> identify(const std::string& path, std::unique_ptr<DeviceCalls> calls);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  int width() const { return width_; }
  int height() const { return height_; }
  double frames_per_second() const { return fps_; }
  const std::string& name() const { return name_; }

  /// Waits for the next frame, at most `timeout_ms`; the error ends the stream (unplugged, or nothing came).
  Result<GrabbedFrame> grab(int timeout_ms);

 private:
  struct Buffer {
    void* memory = nullptr;
    size_t length = 0;
  };

  V4l2Device(std::string path, std::unique_ptr<DeviceCalls> calls) : path_(std::move(path)), calls_(std::move(calls)) {}
  static Result<std::unique_ptr<V4l2Device>> connect(const std::string& path, std::unique_ptr<DeviceCalls> calls);
  int control(unsigned long request, void* argument) const;
  Error failure(const std::string& what) const;
  Status check_capabilities();
  Status choose_format(int width, int height, double fps);
  Status start();

  std::string path_, name_;
  std::unique_ptr<DeviceCalls> calls_;
  int file_ = -1;
  int width_ = 0, height_ = 0, stride_ = 0;
  bool jpeg_ = false, streaming_ = false;
  double fps_ = 0;
  std::vector<Buffer> buffers_;
};

}  // namespace photoslam::internal
