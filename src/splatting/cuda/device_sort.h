// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Launches the kernels of sort_kernels.h in order.

#include "splatting/cuda/device_memory.h"
#include "splatting/cuda/sort_kernels.h"

namespace photoslam::splatting::cuda {

/// Keys with values and a second home for both, between which the passes of a sort go to and fro.
template <class Device>
class Pairs {
 public:
  explicit Pairs(Memory<Device>& memory)
      : keys_(memory),
        values_(memory),
        other_keys_(memory),
        other_values_(memory),
        histogram_(memory),
        totals_(memory) {}

  void reserve(size_t capacity) {
    for (auto* array : {&keys_, &values_, &other_keys_, &other_values_}) array->reserve(capacity);
    histogram_.reserve(size_t{kRadix} * static_cast<size_t>(num_sort_blocks(static_cast<uint32_t>(capacity))));
    totals_.reserve(kRadix);
  }
  void release() {
    for (auto* array : {&keys_, &values_, &other_keys_, &other_values_, &histogram_}) array->release();
  }
  uint32_t* keys() const { return keys_.data(); }
  uint32_t* values() const { return values_.data(); }

  /// Sorts the first *size <= capacity pairs by the lowest `bits` of their keys, stably. keys() and values() change.
  void sort(Device& device, const uint32_t* size, uint32_t capacity, int bits) {
    const int blocks = num_sort_blocks(capacity);
    for (int shift = 0; shift < bits; shift += 8) {
      device.launch(blocks, CountDigits{keys(), size, shift, histogram_.data()});
      if (blocks > 0)
        device.launch(kRadix, PrefixRows{histogram_.data(), static_cast<uint32_t>(blocks), totals_.data()});
      device.launch(blocks, ScatterDigits{keys(), values(), size, shift, histogram_.data(), totals_.data(),
                                          other_keys_.data(), other_values_.data()});
      std::swap(keys_, other_keys_);
      std::swap(values_, other_values_);
    }
  }

 private:
  Array<uint32_t, Device> keys_, values_, other_keys_, other_values_, histogram_, totals_;
};

inline constexpr uint32_t kPrefixColumns = 1024;

/// Numbers to sum up are padded with zeros to whole rows.
constexpr uint32_t padded_for_prefix(uint32_t count) {
  return (count + kPrefixColumns - 1) / kPrefixColumns * kPrefixColumns;
}

/// Exclusive prefix sums in place of padded_for_prefix(count) numbers; `rows` has room for one number per row.
template <class Device>
void prefix_sums(Device& device, uint32_t* values, uint32_t count, uint32_t* rows, uint32_t* total) {
  const uint32_t num_rows = padded_for_prefix(count) / kPrefixColumns;
  if (num_rows == 0) return;
  device.launch(static_cast<int>(num_rows), PrefixRows{values, kPrefixColumns, rows});
  device.launch(1, PrefixRows{rows, num_rows, total});
  device.launch(static_cast<int>(num_rows), AddToRows{values, kPrefixColumns, rows});
}

}  // namespace photoslam::splatting::cuda
