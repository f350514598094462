// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Undistortion on a GPU as the rest of the program sees it. Plain data crosses.

#include "image/undistort_formulas.h"

namespace photoslam::splatting::cuda {

/// A lens, and the camera that its pictures are undistorted to.
struct DeviceLens {
  int width = 0, height = 0;  ///< Of distorted pictures.
  const Tap* taps = nullptr;  ///< [target_height, target_width]; not used after construction.
  int target_width = 0, target_height = 0;
};

/// One picture before and after, in the host's memory.
struct DevicePicture {
  int lens = 0;  ///< Its number.
  enum class Kind { grey, rgb, depth } kind = Kind::grey;
  const void* distorted = nullptr;  ///< [height, width, 3] if rgb, else [height, width]; 16 bits if depth, else 8.
  void* target = nullptr;           ///< [target_height, target_width, …]: as sample_color() and sample_depth() give it.
};

/// Has a stream of its own: works while another thread trains, and does not wait for what that has queued.
class DeviceUndistorter {
 public:
  virtual ~DeviceUndistorter() = default;
  DeviceUndistorter() = default;
  DeviceUndistorter(const DeviceUndistorter&) = delete;
  DeviceUndistorter& operator=(const DeviceUndistorter&) = delete;

  /// All pictures of a frame. May throw DeviceError: what the targets hold then is undefined.
  virtual void undistort(const DevicePicture* pictures, int count) = 0;
};

}  // namespace photoslam::splatting::cuda
