// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "splatting/cuda/device_engine.h"

namespace photoslam::splatting::cuda {

/// A hard limit on what is allocated, by several threads together.
class Budget {
 public:
  explicit Budget(uint64_t limit) : limit_(limit) {}

  /// False: there is not so much left.
  bool take(uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    if (bytes > limit_ - used_) return false;
    used_ += bytes;
    return true;
  }
  void give_back(uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    used_ -= bytes;
  }
  /// What was taken has been allocated.
  void record_peak() {
    const std::lock_guard lock(mutex_);
    peak_ = used_ > peak_ ? used_ : peak_;
  }
  uint64_t limit() const { return limit_; }
  uint64_t used() const {
    const std::lock_guard lock(mutex_);
    return used_;
  }
  uint64_t peak() const {
    const std::lock_guard lock(mutex_);
    return peak_;
  }

 private:
  mutable std::mutex mutex_;
  const uint64_t limit_;
  uint64_t used_ = 0, peak_ = 0;
};

/// Memory of a device, for one thread, within a budget.
template <class Device>
class Memory {
 public:
  Memory(Device& device, uint64_t limit) : Memory(device, std::make_shared<Budget>(limit)) {}
  Memory(Device& device, std::shared_ptr<Budget> budget) : device_(device), budget_(std::move(budget)) {}

  /// Frees something that can be had again; false: there is nothing left to free.
  std::function<bool()> make_room = [] { return false; };

  void* allocate(size_t bytes) {
    while (true) {
      if (budget_->take(bytes)) {
        if (void* const data = device_.allocate(bytes)) {
          budget_->record_peak();
          return data;
        }
        budget_->give_back(bytes);
      }
      if (make_room()) continue;
      throw DeviceError("out of GPU memory: " + std::to_string(bytes >> 20) + " MB wanted, " +
                            std::to_string(budget_->used() >> 20) + " MB in use, limit " +
                            std::to_string(budget_->limit() >> 20) + " MB",
                        true);
    }
  }
  void release(void* data, size_t bytes) {
    device_.release(data);
    budget_->give_back(bytes);
  }
  const std::shared_ptr<Budget>& budget() const { return budget_; }

 private:
  Device& device_;
  std::shared_ptr<Budget> budget_;
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
