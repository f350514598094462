// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "sources/synthetic/geometry/ray_tracer.h"
#include "sources/synthetic/lighting/light.h"

namespace photoslam::synthetic {

/// Gathers the light that arrives at one point of a surface. Seeds only turn the sampling patterns.
class Gatherer {
 public:
  /// Both must outlive the gatherer.
  Gatherer(const RayTracer& tracer, const Lights& lights);

  /// Irradiance / π from the lights; the fourth value is the visible share of the first one.
  Color direct(const Mesh::Surface& surface, uint32_t seed) const;

  /// Radiance of what ray i has hit.
  using Radiance = std::function<Color(const RayTracer::Hits& hits, int i, const Vec3f& direction)>;
  enum class Sampling { fine, coarse };  ///< 64 or 16 rays.
  /// Mean radiance from the hemisphere with cosine weights, that is irradiance / π; from where nothing is hit
  /// comes the light of the sky.
  Color indirect(const Mesh::Surface& surface, uint32_t seed, Sampling sampling, const Radiance& radiance) const;

 private:
  std::pair<Color, float> from_area(const AreaLight& light, const Mesh::Surface& surface, uint32_t seed) const;
  Color from_sun(const Mesh::Surface& surface, uint32_t seed) const;

  const RayTracer& tracer_;
  const Lights& lights_;
  std::vector<Vec2f> disc_, hemisphere_;  ///< Points spread evenly over the unit disc.
};

}  // namespace photoslam::synthetic
