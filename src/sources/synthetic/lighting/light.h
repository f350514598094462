// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/executor.h"
#include "sources/synthetic/geometry/mesh.h"
#include "sources/synthetic/geometry/ray_tracer.h"
#include "sources/synthetic/textures/texture.h"

namespace photoslam::synthetic {

/// Something that shines: a rectangle that shines to one side, or a glowing ball.
struct AreaLight {
  Vec3f center{0, 0, 0};
  Vec3f half_u{0, 0, 0}, half_v{0, 0, 0};  ///< Half edges of a rectangle; zero for a ball.
  Vec3f normal{0, 0, 1};                   ///< The side on which a rectangle shines.
  float radius = 0;                        ///< Of a ball.
  Color radiance{1, 1, 1, 0};

  bool is_ball() const { return radius > 0; }
  float area() const;
  /// Place for a, b in [-1, 1] as seen from a point: on the rectangle, or on the ball's disc that faces the point.
  Vec3f point(float a, float b, const Vec3f& seen_from) const;
};

/// Light from very far away.
struct SunLight {
  Vec3f towards{0, 0, 1};        ///< Unit vector to the sun.
  float radius = 0.02f;          ///< Angular radius [rad]; wider than the real sun's through haze.
  Color irradiance{1, 1, 1, 0};  ///< On a surface that faces the sun.
};

struct Lights {
  std::vector<AreaLight> areas;  ///< The first one is the one mirrored in glossy surfaces.
  SunLight sun;
};

/// Light that arrives at the surfaces, computed once: direct light with soft shadows and two bounces.
class LightMap {
 public:
  LightMap(const Mesh& mesh, std::span<const Texture> textures, const RayTracer& tracer, const Lights& lights,
           Executor& executor);

  /// Irradiance / π, that is the radiance of a white surface, at (u, v) of a patch; the fourth value is the visible
  /// share of the first area light.
  Color sample(const Patch& patch, const Vec2f& uv) const { return sample(nodes_, patch, uv); }

 private:
  static Color sample(const std::vector<Color>& nodes, const Patch& patch, const Vec2f& uv);

  std::vector<Color> nodes_;
};

}  // namespace photoslam::synthetic
