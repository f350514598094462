// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The host in the role of a GPU, for tests: its memory is the "device's", kernels run by host_execution.h.

#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "splatting/cuda/device_engine.h"
#include "splatting/cuda/host_execution.h"

namespace photoslam::splatting::cuda {

/// What is to go wrong on a device.
struct HostFaults {
  std::function<bool()> no_memory = [] { return false; };  ///< Asked at every allocation.
  std::function<bool()> lost = [] { return false; };       ///< Asked at every launch and copy until it is.
  bool is_lost = false;
};

class HostDevice {
 public:
  static constexpr int kUnits = 2;          ///< Multiprocessors.
  static constexpr size_t kSpareShare = 0;  ///< See CudaDevice.

  /// `faults` may be null, else it outlives the device.
  explicit HostDevice(ThreadOrder order = ThreadOrder::forwards, HostFaults* faults = nullptr)
      : order_(order), faults_(faults) {}

  /// Null: there is no more. Memory starts with garbage, as on a GPU, and ends (up to 7 bytes) before a page that
  /// nobody may touch: who reads or writes beyond it crashes.
  void* allocate(size_t bytes) {
    if (faults_ != nullptr && faults_->is_lost) throw DeviceError("the GPU has fallen off the bus", false);
    if (faults_ != nullptr && faults_->no_memory()) return nullptr;
    const size_t page = page_size(), pages = (bytes + page - 1) / page * page;
    void* const base = ::mmap(nullptr, pages + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (base == MAP_FAILED) return nullptr;
    char* const end = static_cast<char*>(base) + pages;
    ::mprotect(end, page, PROT_NONE);
    char* const data = end - (bytes + 7) / 8 * 8;
    std::memset(data, 0xff, bytes);
    mappings_[data] = pages + page;
    return data;
  }
  void release(void* data) {
    const size_t page = page_size(), size = mappings_.at(data);
    const auto address = reinterpret_cast<uintptr_t>(data) / page * page;
    ::munmap(reinterpret_cast<void*>(size == page ? reinterpret_cast<uintptr_t>(data) : address), size);
    mappings_.erase(data);
  }
  void upload(void* to, const void* from, size_t bytes) {
    call();
    if (bytes > 0) std::memcpy(to, from, bytes);
  }
  /// Another one with the same faults.
  HostDevice sibling(size_t) const { return HostDevice(order_, faults_); }
  /// What is there now, as a GPU does these things in order; `to` gets it by finish().
  void download_later(void* to, const void* from, size_t bytes) {
    call();
    const char* const data = static_cast<const char*>(from);
    on_the_way_.emplace_back(to, std::vector<char>(data, data + bytes));
  }
  void finish() {
    call();
    for (const auto& [to, data] : on_the_way_) std::memcpy(to, data.data(), data.size());
    on_the_way_.clear();
  }
  void copy(void* to, const void* from, size_t bytes) { upload(to, from, bytes); }
  void download(void* to, const void* from, size_t bytes) { upload(to, from, bytes); }
  /// Rows of `width` bytes, `pitch` bytes apart, to rows without gaps.
  void download_rows(void* to, const void* from, size_t pitch, size_t width, size_t rows) {
    call();
    for (size_t i = 0; i < rows; ++i)
      std::memcpy(static_cast<char*>(to) + i * width, static_cast<const char*>(from) + i * pitch, width);
  }
  void clear(void* data, size_t bytes) {
    call();
    if (bytes > 0) std::memset(data, 0, bytes);
  }
  int num_units() const { return kUnits; }
  template <class Kernel>
  void launch(int blocks, const Kernel& kernel) {
    if (blocks <= 0) return;
    call();
    auto& threads = threads_[Kernel::kThreads];
    if (threads == nullptr) threads = std::make_unique<HostBlock>(Kernel::kThreads, order_);
    run_on_host(*threads, blocks, kernel);
  }
  void mark(int i) { marks_[i] = std::chrono::steady_clock::now(); }
  float milliseconds(int from, int to) const {
    return std::chrono::duration<float, std::milli>(marks_[to] - marks_[from]).count();
  }

 private:
  static size_t page_size() { return static_cast<size_t>(::sysconf(_SC_PAGESIZE)); }

  void call() {
    if (faults_ == nullptr) return;
    faults_->is_lost = faults_->is_lost || faults_->lost();
    if (faults_->is_lost) throw DeviceError("the GPU has fallen off the bus", false);
  }

  ThreadOrder order_;
  HostFaults* faults_;
  std::chrono::steady_clock::time_point marks_[8];
  std::vector<std::pair<void*, std::vector<char>>> on_the_way_;
  std::map<void*, size_t> mappings_;                   // sizes
  std::map<int, std::unique_ptr<HostBlock>> threads_;  // by their number
};

}  // namespace photoslam::splatting::cuda
