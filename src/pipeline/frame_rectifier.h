// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "image/undistort.h"
#include "sources/frame.h"

namespace photoslam {

/// Turns the raw images of a source into those of the one pinhole camera that tracking, mapping and evaluation share;
/// for stereo also into those of an equal camera, `baseline_m` to its right. Images that fit already pass unchanged.
class FrameRectifier {
 public:
  explicit FrameRectifier(const SourceInfo& info);

  const PinholeCamera& camera() const { return camera_; }
  double baseline_m() const { return baseline_m_; }  ///< 0 unless the sensor is stereo.
  /// How far the camera of a stereo rig was turned about its centre; poses are those of the turned one.
  const Quat& rectified_from_left() const { return rectified_from_left_; }
  /// 255 where the camera has data; empty when it has everywhere.
  ImageU8 mask() const { return left_ ? left_->mask() : ImageU8{}; }

  ImageU8 color(ImageU8 raw) const { return left_ ? left_->color(raw) : std::move(raw); }
  ImageU16 depth(ImageU16 raw) const { return left_ && !raw.empty() ? left_->depth(raw) : std::move(raw); }
  ImageU8 right(ImageU8 raw) const { return right_ && !raw.empty() ? right_->color(raw) : std::move(raw); }

 private:
  PinholeCamera camera_;
  double baseline_m_ = 0;
  Quat rectified_from_left_ = Quat::Identity();
  std::optional<Undistorter> left_, right_;
};

}  // namespace photoslam
