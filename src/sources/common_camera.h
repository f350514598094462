// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "image/undistort.h"
#include "sources/posed_cameras.h"

namespace photoslam {

/// Resamples pictures of any cameras and lenses to what one pinhole camera sees at their places.
class CommonCamera {
 public:
  struct Picture {
    ImageU8 color;
    std::shared_ptr<const ImageU8> mask;  ///< 255 where there is data, 0 elsewhere; null: there is everywhere.
  };

  explicit CommonCamera(const PinholeCamera& camera) : camera_(camera) {}

  const PinholeCamera& camera() const { return camera_; }

  /// A picture that the camera itself took without distortion passes unchanged. One of another size than its camera
  /// says, or of a lens that leaves nothing of it, is an error that names it.
  Result<Picture> take(const PosedCamera& posed, ImageU8 raw);

 private:
  struct Lens {
    PinholeCamera camera;
    Distortion distortion;
    bool sees;  // anything of what the camera would
    std::unique_ptr<const Undistorter> undistorter;
    std::shared_ptr<const ImageU8> mask;
  };
  const Lens& lens_of(const PosedCamera& posed);

  PinholeCamera camera_;
  std::vector<Lens> lenses_;  // met last; each has a table of the size of the picture
};

}  // namespace photoslam
