// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/executor.h"
#include "sources/synthetic/geometry/shapes.h"
#include "sources/synthetic/lighting/light.h"
#include "sources/synthetic/scene_view.h"
#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {

/// How a surface shines; see Material.
struct Finish {
  float gloss = 0.03f;
  float roughness = 0.3f;
  float emission = 0;
  float translucency = 0;
};

/// Everything the renderer needs to know about the room.
struct SceneModel {
  Mesh mesh;
  std::vector<Texture> textures;
  Lights lights;
  Texture backdrop;  ///< What the window shows: fills the rectangle below.
  Vec3f backdrop_corner{0, 0, 0}, backdrop_right{0, 0, 0}, backdrop_down{0, 0, 0};
  bool baked = false;  ///< The textures show the surfaces as they are lit: no light is computed.
};

/// Where furniture is made: shapes, materials and chance. Textures are painted at the end, all together.
class Workshop {
 public:
  Workshop(uint64_t seed, SceneQuality quality);

  /// A material with a texture of its own. Returns its index.
  int material(float width, float height, float texels_per_metre, Shader shader, const Finish& finish = {});
  /// A plain, slightly uneven colour.
  int paint(const Color& color, const Finish& finish = {});

  MeshBuilder& mesh() { return mesh_; }
  Random& random() { return mesh_.random(); }
  uint32_t seed() { return static_cast<uint32_t>(random().next() >> 33); }

  /// Materials that many pieces share.
  int oak, walnut, birch, white, black, brass, steel, pages, wicker, clay, leaf_dark, leaf_light, linen;

  Lights lights;

  SceneModel finish(Executor& executor) &&;

 private:
  struct Job {
    float width, height, texels_per_metre;
    Shader shader;
  };
  float texture_scale_;  ///< Texels per wanted texel, along each axis.
  MeshBuilder mesh_;
  std::vector<Job> jobs_;
};

}  // namespace photoslam::synthetic
