// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/furniture/workshop.h"

#include "sources/synthetic/textures/noise.h"

namespace photoslam::synthetic {

Workshop::Workshop(uint64_t seed, SceneQuality quality)
    : texture_scale_(quality == SceneQuality::full ? 1.0f : 0.3f),
      mesh_(seed, quality == SceneQuality::full ? 1.0 : 4.0) {
  const Finish varnish{.gloss = 0.045f, .roughness = 0.18f};
  oak = material(1.3f, 0.6f, 500, wood(rgb(0xCFA56E), rgb(0x8A5A32), this->seed()), varnish);
  walnut = material(1.3f, 0.6f, 500, wood(rgb(0x8E6242), rgb(0x3E2618), this->seed()), varnish);
  birch = material(1.3f, 0.6f, 450, wood(rgb(0xE2CBA2), rgb(0xB38B5C), this->seed()), varnish);
  white = paint(rgb(0xE4DED2), {.gloss = 0.04f, .roughness = 0.2f});
  black = paint(rgb(0x26272A), {.gloss = 0.05f, .roughness = 0.15f});
  brass = material(0.3f, 0.3f, 500, metal(rgb(0xC49A50), this->seed()), {.gloss = 0.35f, .roughness = 0.15f});
  steel = material(0.3f, 0.3f, 500, metal(rgb(0x9BA0A6), this->seed()), {.gloss = 0.4f, .roughness = 0.12f});
  pages = material(0.3f, 0.1f, 500, book_pages(this->seed()));
  wicker = material(0.5f, 0.5f, 450, basket(this->seed()));
  clay = material(0.5f, 0.3f, 500, terracotta(this->seed()));
  leaf_dark = material(0.1f, 0.3f, 450, leaf_blade(rgb(0x3A6236), this->seed()),
                       {.gloss = 0.05f, .roughness = 0.15f, .translucency = 0.5f});
  leaf_light = material(0.1f, 0.3f, 450, leaf_blade(rgb(0x6F8F45), this->seed()),
                        {.gloss = 0.05f, .roughness = 0.15f, .translucency = 0.5f});
  linen = material(0.8f, 1.6f, 500, curtain(rgb(0xE2D8C4), this->seed()), {.gloss = 0, .translucency = 0.5f});
}

int Workshop::material(float width, float height, float texels_per_metre, Shader shader, const Finish& finish) {
  Material m;
  m.texture = static_cast<int>(jobs_.size());
  m.gloss = finish.gloss;
  m.roughness = finish.roughness;
  m.emission = finish.emission;
  m.translucency = finish.translucency;
  jobs_.push_back({width, height, texture_scale_ * texels_per_metre, std::move(shader)});
  return mesh_.add_material(m, Vec2f(width, height));
}

int Workshop::paint(const Color& color, const Finish& finish) {
  const uint32_t s = seed();
  return material(
      0.4f, 0.4f, 250,
      [=](float x, float y) -> Color { return shade(color, 1 + 0.05f * fractal(x * 14, y * 14, 4, s)); }, finish);
}

SceneModel Workshop::finish(Executor& executor) && {
  SceneModel model;
  for (const Job& job : jobs_) {
    model.textures.push_back(Texture::paint(job.width, job.height, job.texels_per_metre, job.shader, executor));
  }
  model.mesh = std::move(mesh_).finish();
  model.lights = std::move(lights);
  return model;
}

}  // namespace photoslam::synthetic
