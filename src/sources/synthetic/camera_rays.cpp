// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/camera_rays.h"

#include <cmath>
#include <limits>

#include "base/check.h"

namespace photoslam {
namespace {

constexpr std::array<double, CameraRays::kSamples + 1> kOffsetX = {-0.2, 0.6, 0.2, -0.6, 0};
constexpr std::array<double, CameraRays::kSamples + 1> kOffsetY = {-0.6, -0.2, 0.6, 0.2, 0};

}  // namespace

CameraRays::CameraRays(const PinholeCamera& camera, const Distortion& distortion) : camera_(camera) {
  PHOTOSLAM_CHECK(camera.width > 0 && camera.height > 0 && camera.fx > 0 && camera.fy > 0, "{} x {}", camera.width,
                  camera.height);
  if (distortion.none()) return;
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  table_.reserve(static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height) * kOffsetX.size());
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      for (size_t s = 0; s < kOffsetX.size(); ++s) {
        const Vec3 distorted = camera.unproject(Vec2(x + kOffsetX[s], y + kOffsetY[s]), 1.0);
        const std::optional<Vec2> ray = undistort(distortion, distorted.head<2>());
        table_.push_back(ray ? ray->cast<float>() : Eigen::Vector2f(kNone, kNone));
      }
    }
  }
}

Vec3 CameraRays::ray(int x, int y, int sample) const {
  const auto s = static_cast<size_t>(sample);
  if (table_.empty()) return camera_.unproject(Vec2(x + kOffsetX[s], y + kOffsetY[s]), 1.0);
  const auto pixel = static_cast<size_t>(y) * static_cast<size_t>(camera_.width) + static_cast<size_t>(x);
  const Eigen::Vector2f& ray = table_[pixel * kOffsetX.size() + s];
  return std::isnan(ray.x()) ? Vec3(0, 0, 0) : Vec3(ray.x(), ray.y(), 1);
}

}  // namespace photoslam
