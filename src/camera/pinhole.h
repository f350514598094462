// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "math/se3.h"

namespace photoslam {

/// Undistorted camera: used identically by tracking, seeding, rendering and evaluation.
///
/// Axes: x right, y down, z forward. Pixel centres lie at integer coordinates. Lengths in pixels.
struct PinholeCamera {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0;
  double cx = 0, cy = 0;

  /// Pixel of a point in the camera frame; the caller makes sure that z > 0.
  Vec2 project(const Vec3& x) const { return {fx * x.x() / x.z() + cx, fy * x.y() / x.z() + cy}; }
  /// Point in the camera frame seen at pixel p at depth z (the z coordinate, not the distance).
  Vec3 unproject(const Vec2& p, double z) const { return {(p.x() - cx) / fx * z, (p.y() - cy) / fy * z, z}; }
  /// Whether the pixel lies inside the image, `margin` pixels away from its outermost pixel centres.
  bool contains(const Vec2& p, double margin = 0) const {
    return p.x() >= margin && p.y() >= margin && p.x() <= width - 1 - margin && p.y() <= height - 1 - margin;
  }

  bool operator==(const PinholeCamera&) const = default;
};

/// The camera of the same view at 1/factor of the resolution (block-averaged image): pixel block i of the full image
/// becomes pixel i, so x_full = (x_small + ½) factor − ½. Sizes round down.
inline PinholeCamera shrink(const PinholeCamera& camera, int factor) {
  const double s = factor;
  return {camera.width / factor, camera.height / factor,      camera.fx / s,
          camera.fy / s,         (camera.cx + 0.5) / s - 0.5, (camera.cy + 0.5) / s - 0.5};
}

}  // namespace photoslam
