// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/undistort.h"

#include <cmath>

#include "image/convert.h"

namespace photoslam {

Undistorter::Undistorter(const PinholeCamera& camera, const Distortion& distortion)
    : camera_(camera), mask_(camera.width, camera.height) {
  source_.reserve(2 * mask_.values().size());
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec2 ray((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
      Eigen::Matrix2d jacobian;
      const Vec2 bent = distort(distortion, ray, &jacobian);
      const Vec2 pixel(camera.fx * bent.x() + camera.cx, camera.fy * bent.y() + camera.cy);
      // Behind a fold of the model, rays would come back into the image that the lens never saw.
      mask_(x, y) =
          camera.contains(pixel) && jacobian(0, 0) + jacobian(1, 1) > 0 && jacobian.determinant() > 0 ? 255 : 0;
      source_.push_back(static_cast<float>(pixel.x()));
      source_.push_back(static_cast<float>(pixel.y()));
    }
  }
}

ImageU8 Undistorter::color(const ImageU8& distorted) const {
  PHOTOSLAM_CHECK(distorted.same_size(mask_), "{}x{}", distorted.width(), distorted.height());
  ImageU8 result(camera_.width, camera_.height, distorted.channels());
  const float* source = source_.data();
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x, source += 2) {
      if (mask_(x, y) == 0) continue;
      for (int c = 0; c < distorted.channels(); ++c) {
        result(x, y, c) = static_cast<uint8_t>(sample_bilinear(distorted, source[0], source[1], c) + 0.5f);
      }
    }
  }
  return result;
}

ImageU16 Undistorter::depth(const ImageU16& distorted) const {
  PHOTOSLAM_CHECK(distorted.same_size(mask_) && distorted.channels() == 1, "{}x{}x{}", distorted.width(),
                  distorted.height(), distorted.channels());
  ImageU16 result(camera_.width, camera_.height);
  const float* source = source_.data();
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x, source += 2) {
      if (mask_(x, y) == 0) continue;
      result(x, y) = distorted(static_cast<int>(source[0] + 0.5f), static_cast<int>(source[1] + 0.5f));
    }
  }
  return result;
}

}  // namespace photoslam
