// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/gpu_undistorter.h"

#include "splatting/cuda/device_engine.h"

namespace photoslam::splatting {

bool GpuUndistorter::undistort(std::span<const cuda::DevicePicture> pictures) {
  if (device_ == nullptr) return false;
  try {
    device_->undistort(pictures.data(), static_cast<int>(pictures.size()));
    return true;
  } catch (const cuda::DeviceError& e) {
    failure_ = e.what();
    device_.reset();
    return false;
  }
}

}  // namespace photoslam::splatting
