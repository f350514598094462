// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "splatting/cuda/engine.h"
#include "splatting/cuda/host_device.h"
#include "splatting/gpu.h"

namespace photoslam::splatting::testing {

/// A GPU whose kernels the host executes, and that fails where `faults` say so. `memory_limit` in bytes.
inline std::unique_ptr<Gpu> make_host_gpu(cuda::HostFaults* faults = nullptr, uint64_t memory_limit = 1u << 30) {
  using cuda::HostDevice;
  return std::make_unique<Gpu>(
      std::make_unique<cuda::Engine<HostDevice>>(HostDevice(cuda::ThreadOrder::forwards, faults), memory_limit),
      "host");
}

}  // namespace photoslam::splatting::testing
