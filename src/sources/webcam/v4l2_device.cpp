// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/webcam/v4l2_device.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "sources/webcam/pixel_formats.h"

namespace photoslam::internal {
namespace {

constexpr uint32_t kBuffers = 4;

class SystemCalls final : public DeviceCalls {
 public:
  int open(const char* path) override { return ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC); }
  void close(int file) override { ::close(file); }
  int ioctl(int file, unsigned long request, void* argument) override {
    int result = 0;
    do {
      result = ::ioctl(file, request, argument);
    } while (result == -1 && errno == EINTR);
    return result;
  }
  void* map(int file, size_t length, int64_t offset) override {
    void* const memory = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, file, offset);
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void unmap(void* memory, size_t length) override { ::munmap(memory, length); }
  int wait(int file, int timeout_ms) override {
    pollfd entry{file, POLLIN, 0};
    return ::poll(&entry, 1, timeout_ms);
  }
};

v4l2_buffer capture_buffer(uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

std::unique_ptr<DeviceCalls> system_device_calls() { return std::make_unique<SystemCalls>(); }

int V4l2Device::control(unsigned long request, void* argument) const { return calls_->ioctl(file_, request, argument); }

Error V4l2Device::failure(const std::string& what) const {
  return error("{}: {}: {}", path_, what, std::strerror(errno));
}

Result<std::unique_ptr<V4l2Device>> V4l2Device::connect(const std::string& path, std::unique_ptr<DeviceCalls> calls) {
  std::unique_ptr<V4l2Device> device(new V4l2Device(path, std::move(calls)));
  device->file_ = device->calls_->open(path.c_str());
  if (device->file_ < 0) {
    const char* hint = errno == EACCES   ? "; add yourself to the group 'video'"
                       : errno == EBUSY  ? "; another program has it"
                       : errno == ENOENT ? "; is the camera plugged in? 'ls /dev/video*' lists what there is"
                                         : "";
    return error("cannot open the camera {}: {}{}", path, std::strerror(errno), hint);
  }
  if (Status status = device->check_capabilities(); !status) return status.error();
  return device;
}

Result<std::string> V4l2Device::identify(const std::string& path, std::unique_ptr<DeviceCalls> calls) {
  const auto device = connect(path, std::move(calls));
  if (!device) return device.error();
  return (*device)->name();
}

Result<std::unique_ptr<V4l2Device>> V4l2Device::open(const std::string& path, int width, int height, double fps,
                                                     std::unique_ptr<DeviceCalls> calls) {
  auto device = connect(path, std::move(calls));
  if (!device) return device.error();
  if (Status status = (*device)->choose_format(width, height, fps); !status) return status.error();
  if (Status status = (*device)->start(); !status) return status.error();
  return device;
}

V4l2Device::~V4l2Device() {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    control(VIDIOC_STREAMOFF, &type);
  }
  for (const Buffer& buffer : buffers_) calls_->unmap(buffer.memory, buffer.length);
  if (file_ >= 0) calls_->close(file_);
}

Status V4l2Device::check_capabilities() {
  v4l2_capability capability{};
  if (control(VIDIOC_QUERYCAP, &capability) != 0) return error("{} is not a video device", path_);
  const uint32_t able =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((able & V4L2_CAP_VIDEO_CAPTURE) == 0) return error("{} takes no pictures; a camera has several devices", path_);
  if ((able & V4L2_CAP_STREAMING) == 0) return error("{} cannot stream", path_);
  name_ = reinterpret_cast<const char*>(capability.card);  // NOLINT(cppcoreguidelines-pro-type-reinterpret-cast)
  return {};
}

Status V4l2Device::choose_format(int width, int height, double fps) {
  v4l2_format format{};
  for (const uint32_t wanted : {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV}) {
    format = {};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<uint32_t>(width);
    format.fmt.pix.height = static_cast<uint32_t>(height);
    format.fmt.pix.pixelformat = wanted;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (control(VIDIOC_S_FMT, &format) != 0) return failure("the picture format cannot be set");
    if (format.fmt.pix.pixelformat == wanted) break;  // drivers answer with what they do instead
  }
  jpeg_ = format.fmt.pix.pixelformat == V4L2_PIX_FMT_MJPEG;
  if (!jpeg_ && format.fmt.pix.pixelformat != V4L2_PIX_FMT_YUYV) {
    return error("{} ({}) offers neither motion JPEG nor YUYV", path_, name_);
  }
  width_ = static_cast<int>(format.fmt.pix.width);
  height_ = static_cast<int>(format.fmt.pix.height);
  stride_ = std::max(static_cast<int>(format.fmt.pix.bytesperline), jpeg_ ? 0 : 2 * width_);

  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = {1000, static_cast<uint32_t>(1000 * fps)};
  if (control(VIDIOC_S_PARM, &parameters) == 0 && parameters.parm.capture.timeperframe.numerator > 0) {
    const v4l2_fract& interval = parameters.parm.capture.timeperframe;
    fps_ = static_cast<double>(interval.denominator) / interval.numerator;
  }
  return {};
}

Status V4l2Device::start() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (control(VIDIOC_REQBUFS, &request) != 0) return failure("no memory for frames (is another program using it?)");
  for (uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = capture_buffer(i);
    if (control(VIDIOC_QUERYBUF, &buffer) != 0) return failure("no memory for frames");
    void* const memory = calls_->map(file_, buffer.length, buffer.m.offset);
    if (memory == nullptr) return failure("the frames cannot be mapped");
    buffers_.push_back({memory, buffer.length});
    if (control(VIDIOC_QBUF, &buffer) != 0) return failure("a frame buffer is refused");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (control(VIDIOC_STREAMON, &type) != 0) return failure("the stream does not start");
  streaming_ = true;
  return {};
}

Result<GrabbedFrame> V4l2Device::grab(int timeout_ms) {
  v4l2_buffer buffer = capture_buffer(0);
  do {
    const int ready = calls_->wait(file_, timeout_ms);
    if (ready == 0) return error("{} ({}): no frame came for {} ms", path_, name_, timeout_ms);
    if (ready < 0 && errno != EINTR) return failure("the camera is gone");
    if (control(VIDIOC_DQBUF, &buffer) == 0) break;
    if (errno != EAGAIN && errno != EINTR) return failure("the camera is gone");
  } while (true);
  if (buffer.index >= buffers_.size()) return error("{}: the driver named a buffer that is not there", path_);
  GrabbedFrame frame;
  frame.sequence = buffer.sequence;
  frame.timestamp_ns = buffer.timestamp.tv_sec * 1'000'000'000LL + buffer.timestamp.tv_usec * 1'000LL;
  const Buffer& memory = buffers_[buffer.index];
  const std::span bytes(static_cast<const uint8_t*>(memory.memory), std::min<size_t>(buffer.bytesused, memory.length));
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    frame.image = Error{"the driver marked the frame as damaged"};
  } else {
    frame.image = jpeg_ ? decode_mjpeg(bytes) : yuyv_to_rgb(bytes, width_, height_, stride_);
  }
  if (control(VIDIOC_QBUF, &buffer) != 0) return failure("the camera is gone");
  return frame;
}

}  // namespace photoslam::internal
