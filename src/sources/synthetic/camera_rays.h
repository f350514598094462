// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "camera/distortion.h"
#include "camera/pinhole.h"

namespace photoslam {

/// Where the pixels of a camera look: the rays through their centres, and through four samples of their area.
class CameraRays {
 public:
  static constexpr int kSamples = 4;  ///< On a rotated grid.
  static constexpr int kCentre = kSamples;

  explicit CameraRays(const PinholeCamera& camera, const Distortion& distortion = {});

  const PinholeCamera& camera() const { return camera_; }
  /// Ray (x, y, 1) in the camera frame of a sample, or of the centre, of a pixel. Where the lens has no ray the result
  /// is zero.
  Vec3 ray(int x, int y, int sample) const;

 private:
  PinholeCamera camera_;
  std::vector<Eigen::Vector2f> table_;  ///< [H, W, 5] with a distortion; NaN where there is no ray.
};

}  // namespace photoslam
