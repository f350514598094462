// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/textures/noise.h"
#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {

Shader leaf_blade(const Color& green, uint32_t seed) {
  // Fills 0.1 x 0.3 m: the midrib runs down the middle.
  return [=](float x, float y) -> Color {
    const float across = std::abs(x - 0.05f);
    const float rib = smoothstep(0.004f, 0.0015f, across);
    const float veins = smoothstep(0.7f, 0.95f, std::abs(2 * fraction((y + 0.8f * across) * 55) - 1));
    const float spots = fractal(x * 60, y * 30, 4, seed);
    Color c = mix(green, rgb(0xB9C46A), 0.55f * rib + 0.3f * veins + 0.25f * smoothstep(0.2f, 0.6f, spots));
    return shade(c, 1 + 0.2f * spots - 0.15f * noise(x * 20, y * 9, seed + 1));
  };
}

Shader fruit(const Color& ripe, const Color& unripe, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float blush = smoothstep(-0.3f, 0.4f, fractal(x * 18, y * 12, 4, seed));
    const float streaks = 0.2f * noise(x * 260, y * 30, seed + 1);
    Color c = mix(unripe, ripe, std::clamp(blush + streaks, 0.0f, 1.0f));
    const CellNoise pores = cells(x * 250, y * 250, seed + 2);
    c = mix(c, rgb(0xE8D8A0), 0.5f * smoothstep(0.2f, 0.1f, pores.first));
    return c;
  };
}

}  // namespace photoslam::synthetic
