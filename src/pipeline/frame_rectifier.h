// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "image/undistort.h"
#include "sources/frame.h"
#include "splatting/gpu.h"

namespace photoslam {

/// What the cameras saw at one time; depth and right image may be empty.
struct FramePictures {
  ImageU8 color;
  ImageU16 depth;
  ImageU8 right;
};

/// Turns the raw images of a source into those of the one pinhole camera that tracking, mapping and evaluation share;
/// for stereo also into those of an equal camera, `baseline_m` to its right. Images that fit already pass unchanged.
class FrameRectifier {
 public:
  /// With a GPU, rectify() runs there, also while another thread trains.
  explicit FrameRectifier(const SourceInfo& info, const splatting::Gpu* gpu = nullptr);

  const PinholeCamera& camera() const { return camera_; }
  double baseline_m() const { return baseline_m_; }  ///< 0 unless the sensor is stereo.
  /// How far the camera of a stereo rig was turned about its centre; poses are those of the turned one.
  const Quat& rectified_from_left() const { return rectified_from_left_; }
  /// 255 where the camera has data; empty when it has everywhere.
  ImageU8 mask() const { return left_ ? left_->mask() : ImageU8{}; }

  /// All of a frame, on the GPU as long as that works: the same bytes as of the next three. For one thread at a time.
  FramePictures rectify(FramePictures raw);
  /// Why the CPU took over; empty as long as all goes well.
  std::string gpu_failure() const { return gpu_ == nullptr ? "" : gpu_->failure(); }

  ImageU8 color(ImageU8 raw) const { return left_ ? left_->color(raw) : std::move(raw); }
  ImageU16 depth(ImageU16 raw) const { return left_ && !raw.empty() ? left_->depth(raw) : std::move(raw); }
  ImageU8 right(ImageU8 raw) const { return right_ && !raw.empty() ? right_->color(raw) : std::move(raw); }

 private:
  PinholeCamera camera_;
  double baseline_m_ = 0;
  Quat rectified_from_left_ = Quat::Identity();
  std::optional<Undistorter> left_, right_;
  std::unique_ptr<splatting::GpuUndistorter> gpu_;  // lens 0: left_, lens 1: right_; or null
};

}  // namespace photoslam
