// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "splatting/cuda/device_memory.h"
#include "splatting/cuda/device_undistorter.h"
#include "splatting/cuda/undistort_kernels.h"

namespace photoslam::splatting::cuda {

/// The taps stay on the device; pictures go there and come back through pinned memory, all of a frame in one go.
template <class Device>
class Undistorter final : public DeviceUndistorter {
 public:
  Undistorter(Device device, std::shared_ptr<Budget> budget, const DeviceLens* lenses, int count)
      : device_(std::move(device)), memory_(device_, std::move(budget)) {
    for (const DeviceLens& plain : std::span(lenses, static_cast<size_t>(count))) {
      Lens lens{plain, Array<Tap, Device>(memory_)};
      lens.taps.take(lens.target_pixels());
      device_.upload(lens.taps.data(), plain.taps, lens.target_pixels() * sizeof(Tap));
      lenses_.push_back(std::move(lens));
    }
    device_.finish();  // frames find the pinned memory free
  }

  /// Pinned memory for a frame: both ways, color and depth of every lens.
  static size_t staging_bytes(const DeviceLens* lenses, int count) {
    size_t bytes = 0;
    for (const DeviceLens& lens : std::span(lenses, static_cast<size_t>(count)))
      bytes += 5 * (pixels(lens.width, lens.height) + pixels(lens.target_width, lens.target_height));
    return bytes;
  }

  void undistort(const DevicePicture* pictures, int count) override {
    for (const DevicePicture& picture : std::span(pictures, static_cast<size_t>(count))) {
      const Lens& lens = lenses_.at(static_cast<size_t>(picture.lens));
      const size_t bytes = lens.pixels() * bytes_per_pixel(picture.kind);
      const size_t target_bytes = lens.target_pixels() * bytes_per_pixel(picture.kind);
      distorted_.reserve(bytes);
      target_.reserve(target_bytes);
      device_.upload(distorted_.data(), picture.distorted, bytes);
      launch(lens, picture.kind);
      device_.download_later(picture.target, target_.data(), target_bytes);
    }
    device_.finish();
  }

 private:
  struct Lens {
    DeviceLens size;
    Array<Tap, Device> taps;
    size_t pixels() const { return Undistorter::pixels(size.width, size.height); }
    size_t target_pixels() const { return Undistorter::pixels(size.target_width, size.target_height); }
  };

  static size_t pixels(int width, int height) { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  static size_t bytes_per_pixel(DevicePicture::Kind kind) {
    return kind == DevicePicture::Kind::rgb ? 3 : kind == DevicePicture::Kind::depth ? 2 : 1;
  }

  void launch(const Lens& lens, DevicePicture::Kind kind) {
    const size_t count = lens.target_pixels(), width = static_cast<size_t>(lens.size.width);
    const int blocks = static_cast<int>((count + UndistortColor::kThreads - 1) / UndistortColor::kThreads);
    static_assert(UndistortColor::kThreads == UndistortDepth::kThreads);
    if (kind == DevicePicture::Kind::depth)
      device_.launch(
          blocks, UndistortDepth{lens.taps.data(), count, reinterpret_cast<const uint16_t*>(distorted_.data()), width,
                                 reinterpret_cast<uint16_t*>(target_.data())});
    else
      device_.launch(blocks, UndistortColor{lens.taps.data(), count, kind == DevicePicture::Kind::rgb ? 3 : 1,
                                            distorted_.data(), width, target_.data()});
  }

  Device device_;
  Memory<Device> memory_;
  std::vector<Lens> lenses_;
  Array<uint8_t, Device> distorted_{memory_}, target_{memory_};  // one picture after the other, as the stream has them
};

}  // namespace photoslam::splatting::cuda
