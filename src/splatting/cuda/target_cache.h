// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>

#include "splatting/cuda/device_memory.h"
#include "splatting/cuda/target_kernels.h"

namespace photoslam::splatting::cuda {

/// Target images and their smaller versions on the device, the ones used last; the others give way when memory is
/// needed. Smaller ones are made there.
template <class Device>
class TargetCache {
 public:
  struct Entry {
    uint64_t id;
    int factor;
    Extent size;
    TargetPlanes planes;
    int num_valid, num_depth;
    Array<uint8_t, Device> bytes;
  };

  TargetCache(Device& device, Memory<Device>& memory) : device_(device), memory_(memory), counts_(memory) {}

  /// The image at 1/factor of the target's resolution, until the next call. Waits for the device where it has to be
  /// made and has a mask or depth.
  const Entry& get(const DeviceTarget& target, int factor, bool with_depth) {
    in_use_ = 0;
    with_depth = with_depth && target.depth != nullptr;
    for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
      if (entry->id != target.id || entry->factor != factor || (with_depth && entry->planes.depth == nullptr)) continue;
      entries_.splice(entries_.begin(), entries_, entry);
      in_use_ = 1;
      return entries_.front();
    }
    entries_.push_front(factor == 1 ? upload(target, with_depth) : shrink(get(target, 1, with_depth), factor));
    in_use_ = 1;
    return entries_.front();
  }

  /// Gives up the image unused for longest, but never the one in use.
  bool drop_oldest() {
    if (entries_.size() <= in_use_) return false;
    entries_.pop_back();
    return true;
  }
  void forget(uint64_t id) {
    entries_.remove_if([&](const Entry& entry) { return entry.id == id; });
  }

 private:
  /// Room for planes, one behind the other.
  Entry make_room_for(uint64_t id, int factor, Extent size, bool with_mask, bool with_depth) {
    constexpr size_t kAlignment = 256;
    const auto aligned = [](size_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; };
    const size_t pixels = static_cast<size_t>(size.width) * static_cast<size_t>(size.height);
    const size_t mask_at = aligned(3 * pixels), depth_at = mask_at + (with_mask ? aligned(pixels) : 0);
    Entry entry{id, factor, size, {}, static_cast<int>(pixels), 0, Array<uint8_t, Device>(memory_)};
    entry.bytes.take(depth_at + (with_depth ? pixels * sizeof(uint16_t) : 0));
    uint8_t* const base = entry.bytes.data();
    entry.planes = {base, with_mask ? base + mask_at : nullptr,
                    with_depth ? reinterpret_cast<uint16_t*>(base + depth_at) : nullptr};
    return entry;
  }

  Entry upload(const DeviceTarget& target, bool with_depth) {
    Entry entry = make_room_for(target.id, 1, {target.width, target.height}, target.mask != nullptr, with_depth);
    const auto pixels = static_cast<size_t>(entry.num_valid);
    device_.upload(entry.planes.rgb, target.rgb, 3 * pixels);
    if (target.mask != nullptr) device_.upload(entry.planes.mask, target.mask, pixels);
    if (with_depth) device_.upload(entry.planes.depth, target.depth, pixels * sizeof(uint16_t));
    entry.num_valid = target.num_valid;
    entry.num_depth = with_depth ? target.num_depth : 0;
    return entry;
  }

  Entry shrink(const Entry& full, int factor) {
    const bool with_mask = full.planes.mask != nullptr, with_depth = full.planes.depth != nullptr;
    Entry entry =
        make_room_for(full.id, factor, {full.size.width / factor, full.size.height / factor}, with_mask, with_depth);
    counts_.reserve(2);
    device_.clear(counts_.data(), 2 * sizeof(uint32_t));
    device_.launch((entry.num_valid + ShrinkKernel::kThreads - 1) / ShrinkKernel::kThreads,
                   ShrinkKernel{full.planes, full.size, factor, entry.planes, counts_.data()});
    if (!with_mask && !with_depth) return entry;  // every pixel counts
    uint32_t counts[2];
    device_.download(counts, counts_.data(), sizeof(counts));
    entry.num_valid = static_cast<int>(counts[0]);
    entry.num_depth = static_cast<int>(counts[1]);
    return entry;
  }

  Device& device_;
  Memory<Device>& memory_;
  Array<uint32_t, Device> counts_;
  std::list<Entry> entries_;  // used last first
  size_t in_use_ = 0;         // of the first ones
};

}  // namespace photoslam::splatting::cuda
