// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/textures/noise.h"
#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {

Shader brick_wall(uint32_t seed) {
  constexpr float kLength = 0.225f, kHeight = 0.074f, kMortar = 0.011f;
  return [=](float x, float y) -> Color {
    // Hand-laid: nothing is quite straight.
    const float wx = x + 0.004f * fractal(x * 14, y * 14, 2, seed),
                wy = y + 0.004f * fractal(x * 12, y * 16, 2, seed + 1);
    const int row = floor_int(wy / kHeight);
    const float shifted = wx + (row % 2 == 0 ? 0.0f : kLength / 2) + 0.03f * hash01(row, 1, seed);
    const int brick = floor_int(shifted / kLength);
    const float in_x = shifted - static_cast<float>(brick) * kLength, in_y = wy - static_cast<float>(row) * kHeight;
    const float edge =
        std::min({in_x, kLength - in_x, in_y, kHeight - in_y}) + 0.0025f * noise(x * 130, y * 130, seed + 2);
    const float face = smoothstep(kMortar / 2 - 0.002f, kMortar / 2 + 0.002f, edge);

    const float kind = hash01(brick, row, seed + 3), tone = hash01(brick, row, seed + 4);
    Color clay = mix(rgb(0xA5563C), rgb(0xC9825C), tone);
    if (kind > 0.8f) clay = mix(rgb(0x5E3A34), rgb(0x7A4A3E), tone);   // overburnt
    if (kind < 0.15f) clay = mix(rgb(0xC9A27C), rgb(0xD8B998), tone);  // pale
    const float rough = fractal(x * 60, y * 60, 4, seed + 5, 0.65f);
    const float pits = smoothstep(0.35f, 0.6f, noise(x * 150, y * 150, seed + 6));
    clay = shade(clay, 1 + 0.16f * rough + 0.12f * fractal(x * 9, y * 9, 2, seed + 7));
    clay = shade(clay, 1 - 0.4f * pits);
    // Old whitewash that has mostly worn off.
    const float wash = smoothstep(0.15f, 0.6f, fractal(x * 1.7f, y * 1.7f, 5, seed + 8) + 0.25f * rough);
    clay = mix(clay, rgb(0xDDD3C6), 0.5f * wash);
    // Light from above: the upper edge of a brick shines, the mortar below it lies in shadow.
    const float relief =
        smoothstep(0.014f, 0.006f, in_y) * 0.12f - smoothstep(kHeight - 0.014f, kHeight - 0.007f, in_y) * 0.16f;
    clay = shade(clay, 1 + relief);
    Color mortar = shade(rgb(0xB9AEA0), 0.86f + 0.2f * fractal(x * 180, y * 180, 3, seed + 9));
    if (in_y > kHeight / 2) mortar = shade(mortar, 0.82f);
    const Color c = mix(mortar, clay, face);
    return {c[0], c[1], c[2], 0.2f};
  };
}

Shader plaster(const Color& paint, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float clouds = fractal(x * 0.9f, y * 0.9f, 4, seed);
    const float trowel = fractal(x * 7 + 2 * clouds, y * 26, 3, seed + 1);
    const float sand = fractal(x * 170, y * 170, 2, seed + 2, 0.7f);
    const float crack = smoothstep(0.012f, 0.0f, std::abs(fractal(x * 1.3f, y * 1.3f, 5, seed + 3)));
    const float cracked = crack * smoothstep(0.2f, 0.5f, noise(x * 0.8f, y * 0.8f, seed + 4));
    Color c = shade(paint, 1 + 0.06f * clouds + 0.05f * trowel + 0.055f * sand - 0.25f * cracked);
    return {c[0], c[1], c[2], 0.3f};
  };
}

Shader wallpaper(const Color& ground, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float paper = 1 + 0.035f * noise(x * 300, y * 300, seed) + 0.04f * fractal(x * 0.8f, y * 0.8f, 3, seed + 1);
    Color c = shade(ground, paper);
    // Three layers of leaves, the later ones in front.
    for (uint32_t layer = 0; layer < 3; ++layer) {
      const float scale = 6.5f + 1.5f * static_cast<float>(layer);
      const int ix = floor_int(x * scale), iy = floor_int(y * scale);
      for (int j = iy - 1; j <= iy + 1; ++j) {
        for (int i = ix - 1; i <= ix + 1; ++i) {
          const uint32_t s = seed + 10 * layer;
          if (hash01(i, j, s) < 0.25f) continue;
          const float px = x * scale - (static_cast<float>(i) + hash01(i, j, s + 1));
          const float py = y * scale - (static_cast<float>(j) + hash01(i, j, s + 2));
          const float angle = 6.2832f * hash01(i, j, s + 3);
          const float along = px * std::cos(angle) + py * std::sin(angle);
          const float across = -px * std::sin(angle) + py * std::cos(angle) + 0.35f * along * along;
          const float length = 0.55f + 0.4f * hash01(i, j, s + 4);
          const float t = along / length + 0.5f;
          if (t <= 0 || t >= 1) continue;
          const float width = 0.26f * length * std::sin(3.14159f * std::pow(t, 0.7f));
          const float inside = smoothstep(0.0f, 0.03f, width - std::abs(across));
          if (inside <= 0) continue;
          const Color tint = mix(rgb(0x51705A), rgb(0xA9B48A), hash01(i, j, s + 5));
          const float vein =
              smoothstep(0.02f, 0.0f, std::abs(across)) +
              0.6f * smoothstep(0.75f, 0.95f, std::abs(2 * fraction((along + std::abs(across)) * 9) - 1));
          const Color leaf = mix(tint, hash01(i, j, s + 6) < 0.2f ? rgb(0xC98F4E) : ground, 0.35f);
          c = mix(c,
                  shade(leaf, paper * (1 + 0.22f * vein - 0.15f * smoothstep(0.05f, 0.0f, width - std::abs(across)))),
                  inside);
        }
      }
    }
    return {c[0], c[1], c[2], 0.3f};
  };
}

Shader tiles(float size, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const int column = floor_int(x / size), row = floor_int(y / size);
    const uint32_t id = hash(column, row, seed);
    const float u = 2 * fraction(x / size) - 1, v = 2 * fraction(y / size) - 1;
    const float radius = std::hypot(u, v), angle = std::atan2(v, u);
    const float petals = static_cast<float>(3 + id % 6), twist = hash01(column, row, seed + 1);
    const float flower = radius - 0.42f - 0.22f * std::cos(petals * angle + 6 * twist);
    const float rings = std::abs(fraction(radius * static_cast<float>(2 + (id >> 4) % 3) + twist) - 0.5f);
    const float corner = std::abs(std::abs(u) + std::abs(v) - 1.35f - 0.2f * twist);
    const Color inks[] = {rgb(0x2C5A8C), rgb(0xB5533C), rgb(0x3F7A66), rgb(0xD09A3E)};
    const Color ink = inks[id % 4], other = inks[(id >> 8) % 4];
    Color c = mix(rgb(0xEFE6D4), rgb(0xDDD2BC), hash01(column, row, seed + 2));
    c = mix(c, ink, 0.9f * smoothstep(0.05f, -0.03f, flower) * smoothstep(0.1f, 0.2f, rings));
    c = mix(c, other, 0.85f * smoothstep(0.12f, 0.05f, corner));
    c = shade(c, 1 + 0.05f * fractal(x * 120, y * 120, 3, seed + 3));
    const float edge = 1 - std::max(std::abs(u), std::abs(v));
    const float face = smoothstep(0.012f, 0.035f, edge);
    c = mix(rgb(0x8F887C), c, face);
    return {c[0], c[1], c[2], face};
  };
}

Shader terracotta(uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float turning = noise(x * 3, y * 260, seed);
    const float lime = smoothstep(0.1f, 0.7f, fractal(x * 14, y * 14, 4, seed + 1));
    const Color c = mix(rgb(0xB4653F), rgb(0xD9B79C), 0.5f * lime);
    return shade(Color(c[0], c[1], c[2], 0.3f), 1 + 0.08f * turning + 0.1f * fractal(x * 90, y * 90, 3, seed + 2));
  };
}

Shader glaze(const Color& ground, const Color& paint, float height, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float t = y / height;
    const int band = floor_int(t * 7);
    const float in_band = fraction(t * 7);
    const float count = 18 + 10 * hash01(band, 0, seed);
    const float wave = 0.5f + 0.35f * std::sin(x * count * 6 + hash01(band, 1, seed) * 6);
    float ink = 0;
    switch (hash(band, 2, seed) % 4) {
      case 0:
        ink = smoothstep(0.12f, 0.06f, std::abs(in_band - wave));
        break;
      case 1:
        ink = smoothstep(0.05f, 0.0f, std::hypot(fraction(x * count) - 0.5f, in_band - 0.5f) - 0.28f);
        break;
      case 2:
        ink = smoothstep(0.0f, 0.1f, fractal(x * 40, y * 40, 3, seed + 3));
        break;
      default:
        ink = smoothstep(0.4f, 0.45f, in_band);
        break;
    }
    ink = std::max(ink, smoothstep(0.07f, 0.04f, in_band));
    Color c = mix(ground, paint, 0.92f * ink);
    return shade(c, 1 + 0.06f * fractal(x * 50, y * 50, 4, seed + 4));
  };
}

Shader metal(const Color& tone, uint32_t seed) {
  return [=](float x, float y) -> Color {
    return shade(tone, 1 + 0.08f * noise(x * 20, y * 900, seed) + 0.08f * fractal(x * 25, y * 25, 3, seed + 1));
  };
}

}  // namespace photoslam::synthetic
