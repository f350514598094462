// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "camera/pinhole.h"
#include "image/image.h"
#include "math/se3.h"

namespace photoslam::testing {

/// Smooth random texture in [0, 1] on a plane, from a lattice of hashed values.
inline double texture(double u, double v) {
  const auto lattice = [](int i, int j) {
    uint32_t h = static_cast<uint32_t>(i) * 374761393u + static_cast<uint32_t>(j) * 668265263u;
    h = (h ^ (h >> 13)) * 1274126177u;
    return static_cast<double>((h ^ (h >> 16)) & 0xffff) / 65535.0;
  };
  const double fu = std::floor(u), fv = std::floor(v), a = u - fu, b = v - fv;
  const int i = static_cast<int>(fu), j = static_cast<int>(fv);
  return (1 - b) * ((1 - a) * lattice(i, j) + a * lattice(i + 1, j)) +
         b * ((1 - a) * lattice(i, j + 1) + a * lattice(i + 1, j + 1));
}

/// A slanted wall four metres away, and before it, if wanted, a square screen at two; both textured. Exact pictures and
/// depths for tests of dense matching.
struct TexturedWall {
  bool with_screen = false;
  double wall_slope = 0.3;

  struct Hit {
    double depth = 0;  // z in the camera
    double brightness = 0;
    bool screen = false;
  };
  Hit look(const PinholeCamera& camera, const SE3& camera_from_world, double x, double y) const {
    const SE3 world_from_camera = camera_from_world.inverse();
    const Vec3 origin = world_from_camera.translation;
    const Vec3 ray = world_from_camera.rotation * camera.unproject({x, y}, 1.0);
    if (with_screen) {
      const double t = (2.0 - origin.z()) / ray.z();
      const Vec3 p = origin + t * ray;
      if (std::abs(p.x()) < 0.4 && std::abs(p.y()) < 0.4) {
        return {t, texture(31 * p.x() + 100, 31 * p.y()), true};
      }
    }
    const double t = (4.0 + wall_slope * origin.x() - origin.z()) / (ray.z() - wall_slope * ray.x());
    const Vec3 p = origin + t * ray;
    return {t, texture(16 * p.x(), 16 * p.y()), false};
  }
  ImageU8 picture(const PinholeCamera& camera, const SE3& camera_from_world, double gain = 1.0) const {
    ImageU8 image(camera.width, camera.height);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const double value = 40 + 160 * look(camera, camera_from_world, x, y).brightness;
        image(x, y) = static_cast<uint8_t>(std::lround(std::min(gain * value, 255.0)));
      }
    }
    return image;
  }
};

}  // namespace photoslam::testing
