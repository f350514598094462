// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "camera/distortion.h"
#include "camera/pinhole.h"
#include "image/image.h"
#include "image/undistort_formulas.h"

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

  const PinholeCamera& lens() const { return lens_; }      ///< Of the distorted images.
  const PinholeCamera& camera() const { return camera_; }  ///< Of the results.
  /// Where each pixel of a result comes from: [H, W].
  std::span<const Tap> taps() const { return taps_; }

  /// 255 where the result has data, 0 where the lens did not see.
  const ImageU8& mask() const { return mask_; }

  /// Throws unless an image has the lens's size, and one channel or, of 8 bits, three.
  template <class T>
  void check_fits(const Image<T>& distorted) const {
    const int channels = distorted.channels();
    PHOTOSLAM_CHECK(distorted.width() == lens_.width && distorted.height() == lens_.height &&
                        (channels == 1 || (channels == 3 && sizeof(T) == 1)),
                    "{}x{}x{}", distorted.width(), distorted.height(), channels);
  }

  /// Bilinear; black where there is no data. The image has the lens's size and one or three channels.
  ImageU8 color(const ImageU8& distorted) const;

  /// Nearest neighbour, because depths of two surfaces must not be mixed; 0 where there is no data.
  ImageU16 depth(const ImageU16& distorted) const;

 private:
  template <int kChannels>
  void sample(const ImageU8& distorted, ImageU8& result) const;

  PinholeCamera lens_, camera_;
  ImageU8 mask_;
  std::vector<Tap> taps_;  // [H, W]
};

}  // namespace photoslam
