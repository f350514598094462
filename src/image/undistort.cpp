// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/undistort.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace photoslam {
namespace {

/// Splits a coordinate in [0, size − 1] into the first of two neighbours and 256ths of the way to the second.
std::pair<uint16_t, uint16_t> split(double position, int size) {
  const int first = std::min(static_cast<int>(position), size - 2);
  return {static_cast<uint16_t>(first), static_cast<uint16_t>(std::lround((position - first) * 256))};
}

}  // namespace

Undistorter::Undistorter(const PinholeCamera& lens, const Distortion& distortion, const PinholeCamera& result,
                         const Quat& result_from_lens)
    : lens_(lens), camera_(result), mask_(result.width, result.height), taps_(mask_.values().size()) {
  PHOTOSLAM_CHECK(lens.width >= 2 && lens.height >= 2 && lens.width <= Tap::kNowhere, "{}x{}", lens.width, lens.height);
  const Mat3 lens_from_result = result_from_lens.inverse().toRotationMatrix();
  Tap* tap = taps_.data();
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x, ++tap) {
      const Vec3 ray = lens_from_result * result.unproject(Vec2(x, y), 1.0);
      if (!(ray.z() > 0)) continue;
      Eigen::Matrix2d jacobian;
      const Vec2 bent = distort(distortion, ray.head<2>() / ray.z(), &jacobian);
      const Vec2 pixel(lens.fx * bent.x() + lens.cx, lens.fy * bent.y() + lens.cy);
      // Behind a fold of the model, rays would come back into the image that the lens never saw.
      const bool in_order = jacobian.trace() > 0 && jacobian.determinant() > 0;
      if (!lens.contains(pixel) || !in_order) continue;
      mask_(x, y) = 255;
      std::tie(tap->x, tap->fx) = split(pixel.x(), lens.width);
      std::tie(tap->y, tap->fy) = split(pixel.y(), lens.height);
    }
  }
}

/// The number of channels is known while compiling because this is on the way of every frame.
template <int kChannels>
void Undistorter::sample(const ImageU8& distorted, ImageU8& result) const {
  const uint8_t* const source = distorted.values().data();
  const size_t pitch = static_cast<size_t>(lens_.width) * kChannels;
  uint8_t* target = result.values().data();
  for (size_t i = 0; i < taps_.size(); ++i, target += kChannels)
    sample_color<kChannels>(source, pitch, taps_[i], target);
}

ImageU8 Undistorter::color(const ImageU8& distorted) const {
  check_fits(distorted);
  ImageU8 result(camera_.width, camera_.height, distorted.channels());
  distorted.channels() == 3 ? sample<3>(distorted, result) : sample<1>(distorted, result);
  return result;
}

ImageU16 Undistorter::depth(const ImageU16& distorted) const {
  check_fits(distorted);
  ImageU16 result(camera_.width, camera_.height);
  const uint16_t* const source = distorted.values().data();
  uint16_t* const target = result.values().data();
  const auto pitch = static_cast<size_t>(lens_.width);
  for (size_t i = 0; i < taps_.size(); ++i) target[i] = sample_depth(source, pitch, taps_[i]);
  return result;
}

}  // namespace photoslam
