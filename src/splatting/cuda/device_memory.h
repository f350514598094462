// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "splatting/cuda/device_engine.h"

namespace photoslam::splatting::cuda {

/// Counts what is allocated on a device against a hard limit.
template <class Device>
class Memory {
 public:
  Memory(Device& device, uint64_t limit) : device_(device), limit_(limit) {}

  /// Frees something that can be had again; false: there is nothing left to free.
  std::function<bool()> make_room = [] { return false; };

  void* allocate(size_t bytes) {
    while (true) {
      if (used_ + bytes <= limit_) {
        if (void* const data = device_.allocate(bytes)) {
          used_ += bytes;
          peak_ = used_ > peak_ ? used_ : peak_;
          return data;
        }
      }
      if (make_room()) continue;
      throw DeviceError("out of GPU memory: " + std::to_string(bytes >> 20) + " MB wanted, " +
                            std::to_string(used_ >> 20) + " MB in use, limit " + std::to_string(limit_ >> 20) + " MB",
                        true);
    }
  }
  void release(void* data, size_t bytes) {
    device_.release(data);
    used_ -= bytes;
  }
  uint64_t peak() const { return peak_; }

 private:
  Device& device_;
  uint64_t limit_, used_ = 0, peak_ = 0;
};

/// An array on the device that only grows; its contents are not initialised.
template <class T, class Device>
class Array {
 public:
  explicit Array(Memory<Device>& memory) : memory_(&memory) {}
  ~Array() { release(); }
  Array(Array&& other) noexcept
      : memory_(other.memory_), data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  Array& operator=(Array&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }

  /// Room for `size` elements; when it has to grow, contents are lost and some more is taken.
  void reserve(size_t size) {
    if (size <= size_) return;
    release();
    take(Device::kSpareShare > 0 ? size + size / Device::kSpareShare : size);
  }
  /// Exactly so many.
  void take(size_t size) {
    release();
    data_ = static_cast<T*>(memory_->allocate(size * sizeof(T)));
    size_ = size;
  }
  void release() {
    if (data_ != nullptr) memory_->release(data_, size_ * sizeof(T));
    data_ = nullptr;
    size_ = 0;
  }
  T* data() const { return data_; }
  size_t size() const { return size_; }

 private:
  Memory<Device>* memory_;
  T* data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace photoslam::splatting::cuda
