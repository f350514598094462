// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What kernels are written against. A kernel is a struct of arguments with kThreads, a type Shared and
//   template <class Group> PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const;
// The group is its block of threads: DeviceGroup on a GPU, HostGroup (host_execution.h) in tests.

#include <stdint.h>
#include <string.h>

#ifdef __CUDACC__
#define PHOTOSLAM_DEVICE __host__ __device__ inline
#else
#define PHOTOSLAM_DEVICE inline
#endif

#ifdef __CUDA_ARCH__
#define PHOTOSLAM_UNROLL _Pragma("unroll")
#else
#define PHOTOSLAM_UNROLL
#endif

namespace photoslam::splatting::cuda {

inline constexpr int kWarpSize = 32;

struct NoShared {};

PHOTOSLAM_DEVICE uint32_t count_bits(uint32_t mask) {
#ifdef __CUDA_ARCH__
  return static_cast<uint32_t>(__popc(mask));
#else
  return static_cast<uint32_t>(__builtin_popcount(mask));
#endif
}

/// Index of the lowest bit of a mask that is not zero.
PHOTOSLAM_DEVICE int lowest_bit(uint32_t mask) {
#ifdef __CUDA_ARCH__
  return __ffs(static_cast<int>(mask)) - 1;
#else
  return __builtin_ctz(mask);
#endif
}

/// The bits of a float that is not negative: they sort like its value.
PHOTOSLAM_DEVICE uint32_t sortable_bits(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof(bits));
  return bits;
}

#ifdef __CUDACC__

/// The threads of one block. All collectives are called by whole warps.
class DeviceGroup {
 public:
  __device__ int thread() const { return static_cast<int>(threadIdx.x); }
  __device__ int block() const { return static_cast<int>(blockIdx.x); }
  __device__ int num_blocks() const { return static_cast<int>(gridDim.x); }
  __device__ int lane() const { return thread() % kWarpSize; }
  __device__ int warp() const { return thread() / kWarpSize; }
  __device__ void sync() { __syncthreads(); }
  __device__ bool sync_any(bool predicate) { return __syncthreads_or(predicate) != 0; }
  __device__ void sync_warp() { __syncwarp(); }
  __device__ uint32_t ballot(bool predicate) { return __ballot_sync(kAll, predicate); }
  /// Mask of the lanes with the same value.
  __device__ uint32_t match(uint32_t value) { return __match_any_sync(kAll, value); }
  /// The value of the lane before; lane 0 keeps its own.
  template <class T>
  __device__ T from_previous(const T& value) {
    static_assert(sizeof(T) % sizeof(uint32_t) == 0);
    uint32_t words[sizeof(T) / sizeof(uint32_t)];
    memcpy(words, &value, sizeof(T));
    for (uint32_t& word : words) word = __shfl_up_sync(kAll, word, 1);
    T result;
    memcpy(&result, words, sizeof(T));
    return result;
  }
  /// The value of the lane whose number differs in the bits of the mask.
  __device__ float exchange(float value, int mask) { return __shfl_xor_sync(kAll, value, mask); }
  /// Returns the sum before.
  __device__ uint32_t add(uint32_t* sum, uint32_t value) { return atomicAdd(sum, value); }

 private:
  static constexpr unsigned kAll = 0xffffffffu;
};

template <class Kernel>
__global__ void __launch_bounds__(Kernel::kThreads) run_kernel(const Kernel kernel) {
  __shared__ typename Kernel::Shared shared;
  DeviceGroup group;
  kernel(group, shared);
}

#endif  // __CUDACC__

}  // namespace photoslam::splatting::cuda
