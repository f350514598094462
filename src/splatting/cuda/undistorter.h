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
    const std::span all(pictures, static_cast<size_t>(count));
    size_t room = 0;
    for (const DevicePicture& picture : all) room += aligned(bytes_before(picture)) + aligned(bytes_after(picture));
    if (room > pixels_.size()) pixels_.take(room);
    uint8_t* place = pixels_.data();
    for (const DevicePicture& picture : all) {
      uint8_t* const target = place + aligned(bytes_before(picture));
      device_.upload(place, picture.distorted, bytes_before(picture));
      launch(picture, place, target);
      device_.download_later(picture.target, target, bytes_after(picture));
      place = target + aligned(bytes_after(picture));
    }
    device_.finish();
  }

 private:
  static constexpr size_t kAlignment = 256;

  struct Lens {
    DeviceLens size;
    Array<Tap, Device> taps;
    size_t pixels() const { return Undistorter::pixels(size.width, size.height); }
    size_t target_pixels() const { return Undistorter::pixels(size.target_width, size.target_height); }
  };

  static size_t pixels(int width, int height) { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  static size_t aligned(size_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }
  static size_t bytes_per_pixel(DevicePicture::Kind kind) {
    return kind == DevicePicture::Kind::rgb ? 3 : kind == DevicePicture::Kind::depth ? 2 : 1;
  }
  const Lens& lens_of(const DevicePicture& picture) const { return lenses_.at(static_cast<size_t>(picture.lens)); }
  size_t bytes_before(const DevicePicture& picture) const {
    return lens_of(picture).pixels() * bytes_per_pixel(picture.kind);
  }
  size_t bytes_after(const DevicePicture& picture) const {
    return lens_of(picture).target_pixels() * bytes_per_pixel(picture.kind);
  }

  // NOLINTNEXTLINE(readability-non-const-parameter): the kernel writes to it
  void launch(const DevicePicture& picture, const uint8_t* distorted, uint8_t* target) {
    const Lens& lens = lens_of(picture);
    const size_t count = lens.target_pixels(), width = static_cast<size_t>(lens.size.width);
    const int blocks = static_cast<int>((count + UndistortColor::kThreads - 1) / UndistortColor::kThreads);
    static_assert(UndistortColor::kThreads == UndistortDepth::kThreads);
    if (picture.kind == DevicePicture::Kind::depth)
      device_.launch(blocks, UndistortDepth{lens.taps.data(), count, reinterpret_cast<const uint16_t*>(distorted),
                                            width, reinterpret_cast<uint16_t*>(target)});
    else
      device_.launch(blocks, UndistortColor{lens.taps.data(), count, static_cast<int>(bytes_per_pixel(picture.kind)),
                                            distorted, width, target});
  }

  Device device_;
  Memory<Device> memory_;
  std::vector<Lens> lenses_;
  Array<uint8_t, Device> pixels_{memory_};  // of one frame, before and after
};

}  // namespace photoslam::splatting::cuda
