// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "splatting/cuda/device_undistorter.h"

namespace photoslam::splatting {

/// Undistorts frames on a GPU, also while another thread trains there. When it fails it is of no more use, whatever
/// becomes of the training. For one thread at a time.
class GpuUndistorter {
 public:
  explicit GpuUndistorter(std::unique_ptr<cuda::DeviceUndistorter> device) : device_(std::move(device)) {}
  /// One that has failed.
  explicit GpuUndistorter(std::string failure) : failure_(std::move(failure)) {}

  /// The pictures of a frame; false: it has failed, now or before, and the targets hold anything.
  bool undistort(std::span<const cuda::DevicePicture> pictures);

  /// Why it is of no more use; empty as long as all goes well.
  const std::string& failure() const { return failure_; }

 private:
  std::unique_ptr<cuda::DeviceUndistorter> device_;  // null: it has failed
  std::string failure_;
};

}  // namespace photoslam::splatting
