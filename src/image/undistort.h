// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "camera/distortion.h"
#include "camera/pinhole.h"
#include "image/image.h"

namespace photoslam {

/// Resamples images of a lens with distortion to what a pinhole camera at the same place sees.
class Undistorter {
 public:
  /// `camera` holds the intrinsics of the distorted image; it is also the camera of the result.
  Undistorter(const PinholeCamera& camera, const Distortion& distortion)
      : Undistorter(camera, distortion, camera, Quat::Identity()) {}

  /// `result` is any other camera, turned about the common centre by `result_from_lens`.
  Undistorter(const PinholeCamera& lens, const Distortion& distortion, const PinholeCamera& result,
              const Quat& result_from_lens);

  const PinholeCamera& camera() const { return camera_; }

  /// 255 where the result has data, 0 where the lens did not see.
  const ImageU8& mask() const { return mask_; }

  /// Bilinear; black where there is no data. The image has the lens's size and one or three channels.
  ImageU8 color(const ImageU8& distorted) const;

  /// Nearest neighbour, because depths of two surfaces must not be mixed; 0 where there is no data.
  ImageU16 depth(const ImageU16& distorted) const;

 private:
  /// Position in the distorted image: the upper left of four neighbours and the way to the others in 1/256 pixel.
  struct Tap {
    uint16_t x = 0, y = 0;
    uint16_t fx = 0, fy = 0;  // 0…256
  };

  template <int kChannels>
  void sample(const ImageU8& distorted, ImageU8& result) const;

  int lens_width_, lens_height_;
  PinholeCamera camera_;
  ImageU8 mask_;
  std::vector<Tap> taps_;  // [H, W]
};

}  // namespace photoslam
