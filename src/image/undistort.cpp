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
    : lens_width_(lens.width),
      lens_height_(lens.height),
      camera_(result),
      mask_(result.width, result.height),
      taps_(mask_.values().size()) {
  PHOTOSLAM_CHECK(lens.width >= 2 && lens.height >= 2, "{}x{}", lens.width, lens.height);
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
  const uint8_t* const mask = mask_.values().data();
  uint8_t* target = result.values().data();
  for (size_t i = 0; i < taps_.size(); ++i, target += kChannels) {
    if (mask[i] == 0) continue;
    const Tap tap = taps_[i];
    const uint8_t* const above = distorted.row(tap.y) + tap.x * kChannels;
    const uint8_t* const below = distorted.row(tap.y + 1) + tap.x * kChannels;
    const uint32_t left = 256u - tap.fx, right = tap.fx, up = 256u - tap.fy, down = tap.fy;
    for (int c = 0; c < kChannels; ++c) {
      const uint32_t sum = up * (left * above[c] + right * above[c + kChannels]) +
                           down * (left * below[c] + right * below[c + kChannels]);
      target[c] = static_cast<uint8_t>((sum + (1u << 15)) >> 16);
    }
  }
}

ImageU8 Undistorter::color(const ImageU8& distorted) const {
  PHOTOSLAM_CHECK(distorted.width() == lens_width_ && distorted.height() == lens_height_, "{}x{}", distorted.width(),
                  distorted.height());
  ImageU8 result(camera_.width, camera_.height, distorted.channels());
  switch (distorted.channels()) {
    case 1:
      sample<1>(distorted, result);
      break;
    case 3:
      sample<3>(distorted, result);
      break;
    default:
      PHOTOSLAM_CHECK(false, "{} channels", distorted.channels());
  }
  return result;
}

ImageU16 Undistorter::depth(const ImageU16& distorted) const {
  PHOTOSLAM_CHECK(distorted.width() == lens_width_ && distorted.height() == lens_height_ && distorted.channels() == 1,
                  "{}x{}x{}", distorted.width(), distorted.height(), distorted.channels());
  ImageU16 result(camera_.width, camera_.height);
  const auto mask = mask_.values();
  const auto target = result.values();
  for (size_t i = 0; i < taps_.size(); ++i) {
    const Tap tap = taps_[i];
    if (mask[i] != 0) target[i] = distorted(tap.x + (tap.fx >= 128 ? 1 : 0), tap.y + (tap.fy >= 128 ? 1 : 0));
  }
  return result;
}

}  // namespace photoslam
