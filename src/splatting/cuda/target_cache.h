// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>

#include "splatting/cuda/device_memory.h"

namespace photoslam::splatting::cuda {

/// A target image in the device's memory.
struct TargetOnDevice {
  const uint8_t* rgb;
  const uint8_t* mask;
  const uint16_t* depth;
};

/// Target images on the device, the ones used last; the others give way when memory is needed.
template <class Device>
class TargetCache {
 public:
  TargetCache(Device& device, Memory<Device>& memory) : device_(device), memory_(memory) {}

  /// Uploads the image unless it is there.
  TargetOnDevice get(const DeviceTarget& target, size_t pixels) {
    auto entry = entries_.begin();
    while (entry != entries_.end() && entry->id != target.id) ++entry;
    if (entry != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, entry);
    } else {
      upload(target, pixels);
    }
    const uint8_t* const base = entries_.front().bytes.data();
    return {base, target.mask != nullptr ? base + mask_at(pixels) : nullptr,
            target.depth != nullptr ? reinterpret_cast<const uint16_t*>(base + depth_at(pixels)) : nullptr};
  }

  /// Gives up the image unused for longest, but never the one in use.
  bool drop_oldest() {
    if (entries_.size() < 2) return false;
    entries_.pop_back();
    return true;
  }
  void forget(uint64_t id) {
    entries_.remove_if([&](const Entry& entry) { return entry.id == id; });
  }

 private:
  struct Entry {
    uint64_t id;
    Array<uint8_t, Device> bytes;  // colours [3, H, W], mask [H, W], depth [H, W] of two bytes
  };
  static constexpr size_t kAlignment = 256;
  static size_t aligned(size_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }
  static size_t mask_at(size_t pixels) { return aligned(3 * pixels); }
  static size_t depth_at(size_t pixels) { return mask_at(pixels) + aligned(pixels); }

  void upload(const DeviceTarget& target, size_t pixels) {
    entries_.push_front({target.id, Array<uint8_t, Device>(memory_)});
    try {
      uint8_t* const base = (entries_.front().bytes.take(depth_at(pixels) + 2 * pixels), entries_.front().bytes.data());
      device_.upload(base, target.rgb, 3 * pixels);
      if (target.mask != nullptr) device_.upload(base + mask_at(pixels), target.mask, pixels);
      if (target.depth != nullptr) device_.upload(base + depth_at(pixels), target.depth, 2 * pixels);
    } catch (...) {
      entries_.pop_front();
      throw;
    }
  }

  Device& device_;
  Memory<Device>& memory_;
  std::list<Entry> entries_;  // used last first
};

}  // namespace photoslam::splatting::cuda
