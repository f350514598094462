// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cstring>
#include <utility>
#include <vector>

#include "splatting/cuda/device_engine.h"
#include "splatting/cuda/group.h"

namespace photoslam::splatting::cuda {

/// Throws unless the call went well; forgets the error, so that the next call does not report it again.
inline void check_cuda(cudaError_t code, const char* what) {
  if (code == cudaSuccess) return;
  (void)cudaGetLastError();
  throw DeviceError(std::string(what) + ": " + cudaGetErrorString(code), code == cudaErrorMemoryAllocation);
}

/// One GPU through one stream of its own: everything happens in the order of the calls. Calls that hand data to the
/// host wait for it; the others only queue. One thread uses it at a time; several of them, several threads.
class CudaDevice {
 public:
  static constexpr size_t kSpareShare = 8;  ///< Arrays that grow take an eighth more.

  CudaDevice() : CudaDevice(current_device(), kStagingSize, Priority::ordinary) {}
  /// The same GPU, with so much pinned memory, where the thread blocks of kernels start before those of ordinary ones.
  CudaDevice sibling(size_t staging_size) const { return {device_, staging_size, Priority::urgent}; }
  ~CudaDevice() {
    if (stream_ == nullptr) return;
    (void)cudaStreamSynchronize(stream_);
    for (cudaEvent_t event : marks_)
      if (event != nullptr) (void)cudaEventDestroy(event);
    (void)cudaFreeHost(staging_);
    (void)cudaStreamDestroy(stream_);
    (void)cudaGetLastError();
  }
  CudaDevice(CudaDevice&& other) noexcept
      : device_(other.device_),
        num_units_(other.num_units_),
        has_pools_(other.has_pools_),
        stream_(std::exchange(other.stream_, nullptr)),
        staging_(std::exchange(other.staging_, nullptr)),
        staging_size_(std::exchange(other.staging_size_, 0)) {
    for (int i = 0; i < kMarks; ++i) marks_[i] = std::exchange(other.marks_[i], nullptr);
  }
  CudaDevice& operator=(CudaDevice&&) = delete;

  int num_units() const { return num_units_; }

  /// Null: there is no more.
  void* allocate(size_t bytes) {
    bind();
    void* data = nullptr;
    const size_t size = bytes > 0 ? bytes : 1;
    const cudaError_t code = has_pools_ != 0 ? cudaMallocAsync(&data, size, stream_) : cudaMalloc(&data, size);
    if (code == cudaErrorMemoryAllocation) {
      (void)cudaGetLastError();
      return nullptr;
    }
    check_cuda(code, "allocating GPU memory");
    return data;
  }
  /// Nothing can be done about a failure here; a GPU that is gone says so elsewhere.
  void release(void* data) {
    (void)cudaSetDevice(device_);
    (void)(has_pools_ != 0 ? cudaFreeAsync(data, stream_) : cudaFree(data));
    (void)cudaGetLastError();  // or the next launch would report it as its own
  }

  /// `from` may change as soon as this returns. Little data is only queued; of much the copy is waited for.
  void upload(void* to, const void* from, size_t bytes) {
    if (bytes == 0) return;
    bind();
    char* const staged = stage(bytes);
    const bool fits = staged != nullptr;
    if (fits) from = std::memcpy(staged, from, bytes);
    check_cuda(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, stream_), "writing to the GPU");
    if (!fits) wait();
  }
  /// From one place on the GPU to another.
  void copy(void* to, const void* from, size_t bytes) {
    if (bytes == 0) return;
    bind();
    check_cuda(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream_), "copying on the GPU");
  }
  void download(void* to, const void* from, size_t bytes) {
    if (bytes == 0) return;
    bind();
    check_cuda(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream_), "reading from the GPU");
    wait();
  }
  /// As download(), but it need not wait: `to` is complete after finish().
  void download_later(void* to, const void* from, size_t bytes) {
    char* const staged = stage(bytes);
    if (staged == nullptr) return download(to, from, bytes);
    bind();
    check_cuda(cudaMemcpyAsync(staged, from, bytes, cudaMemcpyDeviceToHost, stream_), "reading from the GPU");
    on_the_way_.push_back({to, staged, bytes});
  }
  void finish() {
    bind();
    wait();
  }
  /// Rows of `width` bytes, `pitch` bytes apart, to rows without gaps.
  void download_rows(void* to, const void* from, size_t pitch, size_t width, size_t rows) {
    if (rows == 0) return;
    bind();
    check_cuda(cudaMemcpy2DAsync(to, width, from, pitch, width, rows, cudaMemcpyDeviceToHost, stream_),
               "reading from the GPU");
    wait();
  }
  void clear(void* data, size_t bytes) {
    if (bytes == 0) return;
    bind();
    check_cuda(cudaMemsetAsync(data, 0, bytes, stream_), "clearing GPU memory");
  }

  template <class Kernel>
  void launch(int blocks, const Kernel& kernel) {
    if (blocks <= 0) return;
    bind();
    run_kernel<<<static_cast<unsigned>(blocks), Kernel::kThreads, 0, stream_>>>(kernel);
    check_cuda(cudaGetLastError(), "starting a kernel");
  }

  void mark(int i) { check_cuda(cudaEventRecord(marks_[i], stream_), "recording an event"); }
  /// Between two marks; after a download.
  float milliseconds(int from, int to) const {
    float milliseconds = 0;
    check_cuda(cudaEventElapsedTime(&milliseconds, marks_[from], marks_[to]), "reading an event");
    return milliseconds;
  }

 private:
  static constexpr int kMarks = 8;
  static constexpr size_t kStagingSize = size_t{1} << 20;
  enum class Priority { ordinary, urgent };
  struct Download {
    void* to;
    const char* staged;
    size_t bytes;
  };

  explicit CudaDevice(int device) : device_(device) {}
  CudaDevice(int device, size_t staging_size, Priority priority)
      : CudaDevice(device) {  // from here on the destructor cleans up after an exception
    bind();
    check_cuda(cudaDeviceGetAttribute(&num_units_, cudaDevAttrMultiProcessorCount, device_), "asking the GPU");
    check_cuda(cudaDeviceGetAttribute(&has_pools_, cudaDevAttrMemoryPoolsSupported, device_), "asking the GPU");
    int least = 0, greatest = 0;
    check_cuda(cudaDeviceGetStreamPriorityRange(&least, &greatest), "asking the GPU");
    check_cuda(
        cudaStreamCreateWithPriority(&stream_, cudaStreamNonBlocking, priority == Priority::urgent ? greatest : least),
        "making a stream");
    probe_pools();
    for (cudaEvent_t& event : marks_) check_cuda(cudaEventCreate(&event), "making an event");
    check_cuda(cudaMallocHost(&staging_, staging_size), "allocating pinned memory");
    staging_size_ = staging_size;
  }
  static int current_device() {
    int device = 0;
    check_cuda(cudaGetDevice(&device), "choosing a GPU");
    return device;
  }

  /// Some drivers claim pools of memory that they then refuse (virtual machines).
  void probe_pools() {
    if (has_pools_ == 0) return;
    void* data = nullptr;
    if (cudaMallocAsync(&data, 256, stream_) == cudaSuccess && cudaFreeAsync(data, stream_) == cudaSuccess) return;
    (void)cudaGetLastError();
    has_pools_ = 0;
  }
  void bind() const { check_cuda(cudaSetDevice(device_), "choosing a GPU"); }
  void wait() {
    check_cuda(cudaStreamSynchronize(stream_), "waiting for the GPU");
    for (const Download& download : on_the_way_) std::memcpy(download.to, download.staged, download.bytes);
    on_the_way_.clear();
    staged_ = 0;
  }
  /// Pinned memory until the next wait; null: there is not so much.
  char* stage(size_t bytes) {
    if (bytes > staging_size_ - staged_) return nullptr;
    return staging_ + std::exchange(staged_, staged_ + bytes);
  }

  int device_ = 0, num_units_ = 0, has_pools_ = 0;
  cudaStream_t stream_ = nullptr;
  cudaEvent_t marks_[kMarks] = {};
  char* staging_ = nullptr;  // pinned: data on its way to the GPU and back since the last wait
  size_t staging_size_ = 0, staged_ = 0;
  std::vector<Download> on_the_way_;
};

}  // namespace photoslam::splatting::cuda
