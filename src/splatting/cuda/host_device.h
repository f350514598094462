// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The host in the role of a GPU, for tests: its memory is the "device's", kernels run by host_execution.h.

#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>

#include "splatting/cuda/host_execution.h"

namespace photoslam::splatting::cuda {

class HostDevice {
 public:
  static constexpr int kUnits = 2;  ///< Multiprocessors.

  /// Null: there is no more. Memory starts with garbage, as on a GPU.
  void* allocate(size_t bytes) {
    void* const data = std::malloc(bytes > 0 ? bytes : 1);
    if (data != nullptr) std::memset(data, 0xff, bytes);
    return data;
  }
  void release(void* data) { std::free(data); }
  void upload(void* to, const void* from, size_t bytes) {
    if (bytes > 0) std::memcpy(to, from, bytes);
  }
  void copy(void* to, const void* from, size_t bytes) { upload(to, from, bytes); }
  void download(void* to, const void* from, size_t bytes) { upload(to, from, bytes); }
  /// Rows of `width` bytes, `pitch` bytes apart, to rows without gaps.
  void download_rows(void* to, const void* from, size_t pitch, size_t width, size_t rows) {
    for (size_t i = 0; i < rows; ++i)
      std::memcpy(static_cast<char*>(to) + i * width, static_cast<const char*>(from) + i * pitch, width);
  }
  void clear(void* data, size_t bytes) { std::memset(data, 0, bytes); }
  int num_units() const { return kUnits; }
  template <class Kernel>
  void launch(int blocks, const Kernel& kernel) {
    if (blocks <= 0) return;
    auto& threads = threads_[Kernel::kThreads];
    if (threads == nullptr) threads = std::make_unique<HostBlock>(Kernel::kThreads);
    run_on_host(*threads, blocks, kernel);
  }
  void mark(int) {}
  float milliseconds(int, int) const { return 0; }

 private:
  std::map<int, std::unique_ptr<HostBlock>> threads_;  // by their number
};

}  // namespace photoslam::splatting::cuda
