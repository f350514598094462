// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/executor.h"
#include "sources/synthetic/lighting/gatherer.h"
#include "sources/synthetic/textures/texture.h"

namespace photoslam::synthetic {

/// Light that arrives at the surfaces, computed once: direct light with soft shadows, and light that bounced.
class LightMap {
 public:
  LightMap(const Mesh& mesh, std::span<const Texture> textures, const RayTracer& tracer, const Lights& lights,
           int bounces, Executor& executor);

  /// Irradiance / π, that is the radiance of a white surface, at (u, v) of a patch; the fourth value is the visible
  /// share of the first area light.
  Color sample(const Patch& patch, const Vec2f& uv) const;

 private:
  void add_direct(const Mesh& mesh, const Gatherer& gatherer, Executor& executor);
  /// The light that bounces off the surfaces as the nodes light them now; `index` counts the bounces.
  std::vector<Color> bounce(const Mesh& mesh, std::span<const Texture> textures, const Gatherer& gatherer, int index,
                            Executor& executor) const;

  std::vector<Color> nodes_;
};

}  // namespace photoslam::synthetic
