// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// The module photoslam_cuda.so: the engine on a GPU, with CUDA's runtime inside. The program loads it when it is there.
#include <cstdio>

#include "splatting/cuda/cuda_device.h"
#include "splatting/cuda/engine.h"

namespace photoslam::splatting::cuda {
namespace {

constexpr int kOldestMajor = 7, kOldestMinor = 5;  // compute capability

/// Whether the module holds code for the current GPU, or code that its driver can compile for it.
bool has_code() {
  cudaFuncAttributes attributes{};
  return cudaFuncGetAttributes(&attributes, run_kernel<ClearStatistics>) == cudaSuccess;
}

/// The GPU to use: the first one that is new enough.
bool choose_gpu(char* text, int size) {
  const auto length = static_cast<size_t>(size);
  int count = 0;
  const cudaError_t code = cudaGetDeviceCount(&count);
  if (code != cudaSuccess || count == 0) {
    (void)cudaGetLastError();
    std::snprintf(text, length, "no GPU: %s", code != cudaSuccess ? cudaGetErrorString(code) : "none found");
    return false;
  }
  for (int i = 0; i < count; ++i) {
    cudaDeviceProp properties{};
    if (cudaGetDeviceProperties(&properties, i) != cudaSuccess) continue;
    const int runs = properties.major * 10 + properties.minor >= kOldestMajor * 10 + kOldestMinor;
    std::snprintf(text, length, "%s, %.1f GB, compute capability %d.%d", properties.name,
                  1e-9 * static_cast<double>(properties.totalGlobalMem), properties.major, properties.minor);
    if (runs != 0 && cudaSetDevice(i) == cudaSuccess && cudaFree(nullptr) == cudaSuccess && has_code()) return true;
  }
  (void)cudaGetLastError();
  std::snprintf(text, length, "no GPU that is free, of compute capability %d.%d or newer, and compiled for",
                kOldestMajor, kOldestMinor);
  return false;
}

DeviceEngine* open(uint64_t memory_limit, char* text, int size) {
  if (!choose_gpu(text, size)) return nullptr;
  try {
    return new Engine<CudaDevice>(CudaDevice(), memory_limit);
  } catch (const std::exception& error) {
    std::snprintf(text, static_cast<size_t>(size), "%s", error.what());
    return nullptr;
  }
}

}  // namespace
}  // namespace photoslam::splatting::cuda

extern "C" __attribute__((visibility("default"))) const photoslam::splatting::cuda::Module* photoslam_cuda_module() {
  namespace cuda = photoslam::splatting::cuda;
  static const cuda::Module module = {cuda::kModuleVersion, cuda::choose_gpu, cuda::open};
  return &module;
}
