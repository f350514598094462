// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/check.h"
#include "sources/synthetic/textures/glyphs.h"
#include "sources/synthetic/textures/noise.h"
#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {
namespace {

// All pictures take (u, v) in [0, 1]² and the aspect ratio.

Color landscape(float u, float v, float aspect, uint32_t seed) {
  const float warm = hash01(1, 0, seed);
  const Color high = mix(rgb(0x4C7FB0), rgb(0x35507E), warm), low = mix(rgb(0xDCE6EA), rgb(0xF2B880), warm);
  Color c = mix(high, low, smoothstep(0.0f, 0.6f, v));
  const float cloud = fractal(u * aspect * 3, v * 9, 5, seed);
  c = mix(c, rgb(0xF6EFE6), 0.8f * smoothstep(0.05f, 0.5f, cloud) * smoothstep(0.6f, 0.2f, v));
  const float sun = std::hypot((u - 0.2f - 0.6f * hash01(2, 0, seed)) * aspect, v - 0.28f);
  c = mix(c, rgb(0xFFF0C8), smoothstep(0.07f, 0.055f, sun));
  const Color forest = mix(rgb(0x24382C), rgb(0x4A3A22), warm);
  for (int ridge = 0; ridge < 5; ++ridge) {
    const float depth = static_cast<float>(ridge) / 4;
    const float s = static_cast<float>(seed % 1000) + 13.7f * static_cast<float>(ridge);
    const float line =
        0.38f + 0.13f * static_cast<float>(ridge) -
        (0.16f - 0.02f * static_cast<float>(ridge)) * fractal(u * aspect * (1.6f + depth) + s, s, 5, seed);
    if (v < line) continue;
    const float rock = fractal(u * aspect * 16, v * 30, 4, seed + static_cast<uint32_t>(ridge));
    c = mix(mix(rgb(0x8CA0B4), low, 0.3f), forest, 0.15f + 0.8f * depth);
    c = shade(c, 1 + 0.35f * depth * rock + 0.3f * (1 - depth) * std::max(0.0f, rock));
    if (ridge >= 2) c = shade(c, 1 - 0.35f * smoothstep(0.1f, 0.5f, noise(u * aspect * 110, v * 45, seed + 9)));
  }
  return c;
}

Color map(float u, float v, float aspect, uint32_t seed) {
  const float x = u * aspect * 3.2f, y = v * 3.2f;
  const float height = fractal(x, y, 6, seed) + 0.1f;
  const float paper = 1 + 0.05f * fractal(x * 20, y * 20, 3, seed + 1);
  Color c = height > 0 ? mix(rgb(0xDFCB98), rgb(0xA9A873), smoothstep(0.0f, 0.5f, height))
                       : mix(rgb(0x9FBDC0), rgb(0x7397A6), smoothstep(0.0f, -0.6f, height));
  if (height > 0.35f) c = mix(c, rgb(0x9A6B45), smoothstep(0.35f, 0.7f, height));
  c = shade(c, paper);
  c = mix(c, rgb(0x3B3024), smoothstep(0.02f, 0.006f, std::abs(height)));
  const float contour = std::abs(fraction(height * 9) - 0.5f);
  if (height > 0) c = mix(c, rgb(0x7A5A3A), 0.55f * smoothstep(0.08f, 0.03f, contour));
  const CellNoise land = cells(x * 1.1f, y * 1.1f, seed + 2);
  if (height > 0) c = mix(c, hue(static_cast<float>(land.id % 97) / 97, 0.5f, 0.8f), 0.25f);
  if (height > 0) c = mix(c, rgb(0xA23B2E), 0.8f * smoothstep(0.03f, 0.012f, land.second - land.first));
  const int line = floor_int(v * 26), word = floor_int(u * aspect * 8);
  if (hash(line, word, seed + 3) % 4 == 0) {
    c = mix(c, rgb(0x241D18),
            0.9f * glyph_line(fraction(u * aspect * 8) / 8, fraction(v * 26) / 26 - 0.008f, 0.017f,
                              hash(line, word, seed)));
  }
  const float grid = std::min(std::abs(fraction(u * aspect * 4) - 0.5f), std::abs(fraction(v * 4) - 0.5f));
  return mix(c, rgb(0x5A4A3A), 0.5f * smoothstep(0.012f, 0.005f, grid));
}

Color shapes(float u, float v, float aspect, uint32_t seed) {
  Color c = shade(rgb(0xE9DEC6), 1 + 0.04f * fractal(u * 60 * aspect, v * 60, 3, seed));
  const Color inks[] = {rgb(0xC9402E), rgb(0x1E4C7A), rgb(0xE0A42E), rgb(0x22211F), rgb(0x3B7A6B)};
  for (int k = 0; k < 11; ++k) {
    const float x = u - hash01(k, 1, seed), y = v - hash01(k, 2, seed);
    const float angle = 3.14159f * static_cast<float>(hash(k, 3, seed) % 4) / 4;
    const float a = (x * std::cos(angle) + y / aspect * std::sin(angle)) * aspect,
                b = -x * aspect * std::sin(angle) + y * std::cos(angle);
    const float size = 0.06f + 0.2f * hash01(k, 4, seed);
    float distance = 0;
    switch (hash(k, 5, seed) % 4) {
      case 0:
        distance = std::hypot(a, b) - size;
        break;
      case 1:
        distance = std::abs(std::hypot(a, b) - size) - 0.02f;
        break;
      case 2:
        distance = std::max(std::abs(a) - size, std::abs(b) - 0.35f * size);
        break;
      default:
        distance = std::max(std::abs(a) - 0.02f, std::abs(b) - 2 * size);
        break;
    }
    const float print = 0.92f + 0.08f * noise(u * 200 * aspect, v * 200, seed + 6);
    c = mix(c, inks[hash(k, 6, seed) % 5], print * smoothstep(0.004f, -0.002f, distance));
  }
  if (v > 0.88f && u > 0.08f && u < 0.92f)
    c = mix(c, rgb(0x22211F), glyph_line((u - 0.08f) * aspect, v - 0.9f, 0.055f, seed + 7));
  return c;
}

Color skyline(float u, float v, float aspect, uint32_t seed) {
  Color c =
      mix(rgb(0x16233F), rgb(0xD9784A), smoothstep(0.0f, 0.85f, v + 0.12f * fractal(u * aspect * 3, v * 7, 4, seed)));
  for (int layer = 0; layer < 4; ++layer) {
    const float width = 0.1f - 0.012f * static_cast<float>(layer);
    const float x = u * aspect + 0.37f * static_cast<float>(layer);
    const int house = floor_int(x / width);
    const float top = 0.75f - (0.55f - 0.1f * static_cast<float>(layer)) * hash01(house, layer, seed);
    if (v < top) continue;
    const float depth = static_cast<float>(layer) / 3;
    c = mix(mix(rgb(0x6B6478), rgb(0xA26A5C), hash01(house, layer, seed + 1)), rgb(0x141820), 0.35f + 0.55f * depth);
    const float wx = fraction(x / width) * 5, wy = (v - top) * 42;
    const bool window = fraction(wx) > 0.3f && fraction(wx) < 0.75f && fraction(wy) > 0.3f && fraction(wy) < 0.8f;
    if (window && hash(house * 5 + floor_int(wx), floor_int(wy) + 99 * layer, seed + 2) % 5 < 2)
      c = mix(rgb(0xFFD98A), rgb(0xFFF3D0), hash01(house, floor_int(wy), seed));
  }
  if (v > 0.93f) c = shade(rgb(0x1B2430), 1 + 0.4f * noise(u * aspect * 30, v * 120, seed + 3));
  return c;
}

Color abstract(float u, float v, float aspect, uint32_t seed) {
  const float x = u * aspect * 2, y = v * 2;
  const float wx = x + 0.7f * fractal(x, y, 4, seed), wy = y + 0.7f * fractal(x + 5, y + 9, 4, seed + 1);
  const float field = fractal(wx * 1.4f, wy * 1.4f, 5, seed + 2), other = fractal(wx * 2, wy * 2, 4, seed + 3);
  const float start = hash01(0, 0, seed);
  Color c = mix(hue(start, 0.65f, 0.75f), hue(start + 0.14f, 0.55f, 0.92f), smoothstep(-0.5f, 0.5f, field));
  c = mix(c, hue(start + 0.52f, 0.6f, 0.45f), smoothstep(0.12f, 0.2f, other));
  c = mix(c, rgb(0xF2E8D5), smoothstep(0.3f, 0.36f, field));
  const float bristle = noise(wx * 9 + wy * 70, wy * 6 - wx * 18, seed + 4);
  c = shade(c, 1 + 0.2f * bristle);
  const CellNoise splash = cells(x * 7, y * 7, seed + 5);
  if (splash.id % 4 == 0)
    c = mix(c, splash.id % 8 == 0 ? rgb(0x1A1A20) : rgb(0xF0C040), smoothstep(0.16f, 0.12f, splash.first));
  return c;
}

Color botanical(float u, float v, float aspect, uint32_t seed) {
  Color c = shade(rgb(0xEDE4CF), 1 + 0.06f * fractal(u * 25, v * 25, 4, seed));
  const float stem = 0.5f + 0.06f * std::sin(5 * v + 6 * hash01(0, 0, seed));
  const float x = (u - stem) * aspect;
  if (v > 0.1f && v < 0.85f) c = mix(c, rgb(0x4D5A30), smoothstep(0.008f, 0.004f, std::abs(x)));
  for (int k = 0; k < 16; ++k) {
    const float base = 0.12f + 0.045f * static_cast<float>(k);
    const float side = k % 2 == 0 ? 1.0f : -1.0f;
    const float a = side * x, b = v - base + 0.5f * a;
    const float length =
        (0.3f * std::sin(3.14159f * (0.15f + 0.8f * base)) + 0.05f) * (0.8f + 0.4f * hash01(k, 1, seed));
    const float t = a / length;
    if (t <= 0 || t >= 1) continue;
    const float width = 0.06f * std::sin(3.14159f * std::sqrt(t)) * (1 + 0.15f * std::sin(70 * t));
    const float inside = smoothstep(0.0f, 0.006f, width - std::abs(b));
    const float vein = smoothstep(0.004f, 0.001f, std::abs(b)) +
                       0.5f * smoothstep(0.7f, 1.0f, std::abs(2 * fraction((a + std::abs(b)) * 45) - 1));
    const Color green = mix(rgb(0x3F6B3A), rgb(0xA8A24A), hash01(k, 2, seed));
    c = mix(c, shade(green, 1 - 0.35f * vein + 0.2f * noise(u * 90, v * 90, seed + 3)), inside);
  }
  if (v > 0.9f && u > 0.2f && u < 0.8f)
    c = mix(c, rgb(0x4A3B2C), glyph_line((u - 0.2f) * aspect, v - 0.915f, 0.035f, seed + 5));
  return c;
}

Color paint(PictureKind kind, float u, float v, float aspect, uint32_t seed) {
  switch (kind) {
    case PictureKind::landscape:
      return landscape(u, v, aspect, seed);
    case PictureKind::map:
      return map(u, v, aspect, seed);
    case PictureKind::shapes:
      return shapes(u, v, aspect, seed);
    case PictureKind::skyline:
      return skyline(u, v, aspect, seed);
    case PictureKind::abstract:
      return abstract(u, v, aspect, seed);
    case PictureKind::botanical:
      return botanical(u, v, aspect, seed);
  }
  PHOTOSLAM_CHECK(false, "picture kind {}", static_cast<int>(kind));
}

}  // namespace

Shader picture(PictureKind kind, float width, float height, uint32_t seed) {
  return [=](float x, float y) -> Color { return paint(kind, x / width, y / height, width / height, seed); };
}

Shader pin_board(float width, float height, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const CellNoise cork = cells(x * 260, y * 260, seed);
    Color c =
        shade(mix(rgb(0xB98A58), rgb(0x8A5E36), hash01(static_cast<int>(cork.id), 0, seed)), 0.85f + 0.4f * cork.first);
    const float rim = std::min({x, width - x, y, height - y});
    if (rim < 0.018f) return shade(rgb(0x6B4A2E), 0.9f + 0.2f * noise(x * 60, y * 60, seed));
    // Notes, tickets and photographs, each a little askew; the later ones on top.
    for (int k = 0; k < 34; ++k) {
      const float w = 0.07f + 0.09f * hash01(k, 1, seed), h = 0.06f + 0.1f * hash01(k, 2, seed);
      const float cx = lerp(0.09f, width - 0.09f, hash01(k, 3, seed)),
                  cy = lerp(0.08f, height - 0.08f, hash01(k, 4, seed));
      const float angle = 0.3f * (hash01(k, 5, seed) - 0.5f);
      const float a = (x - cx) * std::cos(angle) + (y - cy) * std::sin(angle) + w / 2,
                  b = -(x - cx) * std::sin(angle) + (y - cy) * std::cos(angle) + h / 2;
      if (a > -0.003f && a < w + 0.005f && b > -0.002f && b < h + 0.006f) c = shade(c, 0.62f);
      if (a < 0 || a > w || b < 0 || b > h) continue;
      const uint32_t kind = hash(k, 6, seed) % 5;
      if (kind < 2) {
        const float margin = 0.006f;
        const bool art = a > margin && a < w - margin && b > margin && b < h - 2 * margin;
        c = art ? paint(static_cast<PictureKind>(hash(k, 7, seed) % 6), (a - margin) / (w - 2 * margin),
                        (b - margin) / (h - 3 * margin), w / h, seed + static_cast<uint32_t>(k))
                : rgb(0xF2EFE8);
      } else {
        const Color papers[] = {rgb(0xF0E27C), rgb(0xEFEBE0), rgb(0xE8A6A0), rgb(0xA9D0C4)};
        c = papers[hash(k, 8, seed) % 4];
        const float line = 0.012f;
        if (a > 0.007f && a < w - 0.007f && b > 0.014f) {
          c = mix(c, rgb(0x2A3350),
                  glyph_line(a - 0.007f, fraction(b / line) * line, 0.0075f,
                             seed + 100 * static_cast<uint32_t>(k) + static_cast<uint32_t>(b / line)));
        }
      }
      const float pin = std::hypot(a - w / 2, b - 0.008f);
      if (pin < 0.006f) c = shade(hue(hash01(k, 9, seed), 0.8f, 0.8f), 1.2f - 60 * pin);
    }
    return {c[0], c[1], c[2], 0.3f};
  };
}

Shader globe(float radius, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const Color c = map(x / (2 * radius), y / (2 * radius), 1.0f, seed);
    return {c[0], c[1], c[2], 1};
  };
}

Shader garden(float width, float height, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float u = x / width, v = y / height, aspect = width / height;
    Color c = mix(rgb(0x9CC4EA), rgb(0xE8F1F5), smoothstep(0.0f, 0.6f, v));
    c = mix(c, rgb(0xFFFFFF), 0.8f * smoothstep(0.0f, 0.5f, fractal(u * aspect * 2, v * 5, 5, seed)));
    for (int layer = 0; layer < 3; ++layer) {
      const float s = 7.7f * static_cast<float>(layer);
      const float top =
          0.36f + 0.17f * static_cast<float>(layer) - 0.2f * fractal(u * aspect * 1.8f + s, s, 6, seed + 1, 0.6f);
      if (v < top) continue;
      const float crown = fractal(x * 3, y * 3, 4, seed + 2 + static_cast<uint32_t>(layer)),
                  leaves = fractal(x * 14, y * 14, 4, seed + 8, 0.7f);
      c = shade(mix(rgb(0x86A079), rgb(0x4E7038), static_cast<float>(layer) / 2), 1 + 0.4f * crown + 0.35f * leaves);
    }
    if (v > 0.86f) c = shade(rgb(0x9AA65C), 1 + 0.2f * fractal(x * 12, y * 50, 3, seed + 9));
    return c;
  };
}

}  // namespace photoslam::synthetic
