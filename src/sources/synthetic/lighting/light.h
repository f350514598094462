// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "sources/synthetic/geometry/mesh.h"

namespace photoslam::synthetic {

/// Something that shines: a rectangle that shines to one side, or a glowing ball.
struct AreaLight {
  Vec3f center{0, 0, 0};
  Vec3f half_u{0, 0, 0}, half_v{0, 0, 0};  ///< Half edges of a rectangle; zero for a ball.
  Vec3f normal{0, 0, 1};                   ///< The side on which a rectangle shines.
  float radius = 0;                        ///< Of a ball.
  Color radiance{1, 1, 1, 0};

  bool is_ball() const { return radius > 0; }
  /// Area [m²] of the rectangle, or of the disc that a ball looks like.
  float area() const;
  /// Place for a, b in [-1, 1] as seen from a point: on the rectangle, or on the disc before the ball that faces the
  /// point.
  Vec3f point(float a, float b, const Vec3f& seen_from) const;
};

/// Light from very far away.
struct SunLight {
  Vec3f towards{0, 0, 1};        ///< Unit vector to the sun.
  float radius = 0.02f;          ///< Angular radius [rad]; wider than the real sun's through haze.
  Color irradiance{0, 0, 0, 0};  ///< On a surface that faces the sun.
};

struct Lights {
  std::vector<AreaLight> areas;  ///< The first one is the one mirrored in glossy surfaces.
  SunLight sun;
  std::function<Color(const Vec3f& direction)> sky;  ///< Radiance from where nothing is; empty indoors. Unit vectors.
};

/// Two axes orthogonal to a unit vector and to each other. Source: Duff et al., "Building an orthonormal basis,
/// revisited", 2017.
std::pair<Vec3f, Vec3f> orthogonal_axes(const Vec3f& normal);

}  // namespace photoslam::synthetic
