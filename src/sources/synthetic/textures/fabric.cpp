// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/textures/noise.h"
#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {
namespace {

/// Relief of a plain weave with the given distance between threads: about 1 on top of a thread, less between them.
float weave(float x, float y, float pitch, uint32_t seed) {
  const int i = floor_int(x / pitch), j = floor_int(y / pitch);
  const float u = 2 * fraction(x / pitch) - 1, v = 2 * fraction(y / pitch) - 1;
  const bool warp_on_top = (i + j) % 2 == 0;
  const float across = warp_on_top ? u : v, along = warp_on_top ? v : u;
  return (0.7f + 0.3f * hash01(warp_on_top ? i : j, warp_on_top ? 1 : 2, seed)) * (1 - 0.5f * across * across) *
         (1 - 0.25f * along * along);
}

Color matte(const Color& c) { return {c[0], c[1], c[2], 0.1f}; }

}  // namespace

Shader tweed(const Color& a, const Color& b, uint32_t seed) {
  return [=](float x, float y) -> Color {
    constexpr float kPitch = 0.0045f;
    const int i = floor_int(x / kPitch), j = floor_int(y / kPitch);
    // Herringbone: the diagonal turns round every few centimetres.
    const int turn = floor_int(x / (9 * kPitch)) % 2 == 0 ? 1 : -1;
    const bool warp = ((i * turn + j) % 4 + 4) % 4 < 2;
    Color c = mix(a, b, warp ? 0.12f + 0.3f * hash01(i, 7, seed) : 0.6f + 0.4f * hash01(j, 8, seed));
    const float fleck = hash01(i, j, seed + 1);
    if (fleck > 0.975f) c = mix(c, rgb(0xD8B46A), 0.6f);
    if (fleck < 0.02f) c = shade(c, 0.55f);
    const float worn = fractal(x * 2.5f, y * 2.5f, 4, seed + 2);
    return matte(shade(c, weave(x, y, kPitch, seed) * (1.1f + 0.12f * worn)));
  };
}

Shader stripes(uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float wobble = x + 0.0015f * noise(x * 30, y * 60, seed);
    const int band = floor_int(wobble / 0.022f);
    const Color yarns[] = {rgb(0xE6DCC8), rgb(0xC4553F), rgb(0x2F4858), rgb(0xE0A64B), rgb(0x86A59C), rgb(0xE6DCC8)};
    Color c = yarns[hash(band, 0, seed + 1) % 6];
    const float in_band = fraction(wobble / 0.022f);
    if (hash01(band, 1, seed) > 0.55f && std::abs(in_band - 0.5f) < 0.16f) c = yarns[hash(band, 3, seed) % 6];
    return matte(shade(c, 1.1f * weave(x, y, 0.004f, seed + 2) + 0.06f * fractal(x * 60, y * 60, 3, seed + 3)));
  };
}

Shader ikat(uint32_t seed) {
  return [=](float x, float y) -> Color {
    // Dyed before weaving: the threads along y bleed and slip against each other.
    const int thread = floor_int(x / 0.003f);
    const float slip = 0.008f * (hash01(thread, 0, seed) - 0.5f) + 0.012f * noise(x * 40, 0.5f, seed + 1);
    const float u = x / 0.16f, v = (y + slip) / 0.2f;
    const int column = floor_int(u), row = floor_int(v + 0.5f * static_cast<float>(column % 2));
    const float diamond =
        std::abs(fraction(u) - 0.5f) + std::abs(fraction(v + 0.5f * static_cast<float>(column % 2)) - 0.5f);
    const float size = 0.3f + 0.15f * hash01(column, row, seed + 2);
    Color c = rgb(0x21405E);
    const Color inner = hash(column, row, seed + 3) % 2 ? rgb(0xC2452F) : rgb(0xE0B04E);
    c = mix(c, rgb(0xEDE3CF), smoothstep(size + 0.05f, size - 0.02f, diamond));
    c = mix(c, inner, smoothstep(size - 0.1f, size - 0.16f, diamond));
    c = mix(c, rgb(0x21405E), smoothstep(size - 0.24f, size - 0.28f, diamond));
    return matte(shade(c, 1.05f * weave(x, y, 0.003f, seed + 4) + 0.08f * noise(x * 500, y * 40, seed + 5)));
  };
}

Shader flowers(uint32_t seed) {
  return [=](float x, float y) -> Color {
    Color c = rgb(0xE9DFCB);
    const CellNoise twig = cells(x * 22, y * 22, seed);
    c = mix(c, rgb(0x7E9468), 0.9f * smoothstep(0.09f, 0.04f, twig.second - twig.first));
    for (uint32_t layer = 0; layer < 2; ++layer) {
      const float scale = 14 + 9 * static_cast<float>(layer);
      const int ix = floor_int(x * scale), iy = floor_int(y * scale);
      for (int j = iy - 1; j <= iy + 1; ++j) {
        for (int i = ix - 1; i <= ix + 1; ++i) {
          const uint32_t s = seed + 20 + 7 * layer;
          const float px = x * scale - (static_cast<float>(i) + hash01(i, j, s));
          const float py = y * scale - (static_cast<float>(j) + hash01(i, j, s + 1));
          const float radius = std::hypot(px, py);
          const float petals = 0.34f + 0.1f * std::cos(5 * std::atan2(py, px) + 6 * hash01(i, j, s + 2));
          const Color colors[] = {rgb(0xC8503C), rgb(0xD98C4A), rgb(0x5B6FA0), rgb(0xB8476B)};
          const Color petal = shade(colors[hash(i, j, s + 3) % 4], 0.8f + 0.8f * radius);
          c = mix(c, petal, smoothstep(0.03f, -0.03f, radius - petals));
          c = mix(c, rgb(0xE8C25A), smoothstep(0.03f, -0.02f, radius - 0.1f));
        }
      }
    }
    return matte(shade(c, 1.08f * weave(x, y, 0.003f, seed + 5)));
  };
}

Shader knit(const Color& wool, uint32_t seed) {
  return [=](float x, float y) -> Color {
    constexpr float kPitch = 0.014f;
    const int column = floor_int(x / kPitch);
    const float u = fraction(x / kPitch), slant = u < 0.5f ? u : 1 - u;
    const float v = fraction(y / (0.8f * kPitch) + 0.9f * slant);
    const float loop =
        std::sqrt(std::max(0.0f, 1 - (2 * v - 1) * (2 * v - 1))) * (0.55f + 0.45f * std::sin(6.2832f * slant));
    const float band = smoothstep(0.2f, 0.3f, std::abs(fraction(y / 0.21f) - 0.5f));
    const Color yarn = mix(rgb(0xE9DDC6), wool, band);
    const float hair = noise(x * 700, y * 700, seed) * 0.12f;
    return matte(shade(yarn, 0.35f + 0.65f * loop + hair + 0.1f * hash01(column, floor_int(y / kPitch), seed)));
  };
}

Shader curtain(const Color& linen, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const float slub = 0.5f * noise(x * 30, y * 500, seed) + 0.5f * noise(x * 500, y * 30, seed + 1);
    Color c = shade(linen, 0.93f + 0.14f * slub + 0.1f * weave(x, y, 0.004f, seed));
    // Loosely printed twigs.
    const CellNoise cell = cells(x * 8, y * 5, seed + 2);
    const float twig = std::abs(cell.first - 0.3f + 0.1f * noise(x * 25, y * 25, seed + 3));
    const Color print = cell.id % 3 == 0 ? rgb(0xA6633F) : rgb(0x66805F);
    c = mix(c, print,
            0.65f * smoothstep(0.09f, 0.03f, twig) * smoothstep(-0.3f, 0.2f, noise(x * 30, y * 30, seed + 4)));
    return matte(c);
  };
}

Shader leather(const Color& hide, uint32_t seed) {
  return [=](float x, float y) -> Color {
    const CellNoise pebble = cells(x * 220, y * 220, seed);
    const float crease = smoothstep(0.25f, 0.0f, pebble.second - pebble.first);
    const float folds = smoothstep(0.06f, 0.0f, std::abs(fractal(x * 4, y * 7, 3, seed + 1)));
    const float worn = fractal(x * 3, y * 3, 4, seed + 2);
    Color c = shade(hide, 1 - 0.3f * crease - 0.3f * folds + 0.22f * worn);
    return {c[0], c[1], c[2], 1 - 0.5f * crease};
  };
}

Shader rug(float width, float height, uint32_t seed) {
  return [=](float x, float y) -> Color {
    // Hand-knotted: every decision is made per knot.
    constexpr float kKnot = 0.0055f;
    const int i = floor_int(x / kKnot), j = floor_int(y / kKnot);
    const float kx = (static_cast<float>(i) + 0.5f) * kKnot, ky = (static_cast<float>(j) + 0.5f) * kKnot;
    const Color red = rgb(0x9C2F2B), blue = rgb(0x24365C), cream = rgb(0xE3D2AE), gold = rgb(0xC08A3A),
                green = rgb(0x54714F), black = rgb(0x2A2327);
    const Color dyes[] = {red, blue, cream, gold, green, black};
    const float border = std::min({kx, width - kx, ky, height - ky});
    Color c;
    if (border < 0.03f) {
      c = blue;
    } else if (border < 0.22f) {
      const int cx = floor_int(kx / 0.095f), cy = floor_int(ky / 0.095f);
      const float u = fraction(kx / 0.095f) - 0.5f, v = fraction(ky / 0.095f) - 0.5f;
      const float shape = hash(cx, cy, seed) % 3 == 0 ? std::max(std::abs(u), std::abs(v)) : std::abs(u) + std::abs(v);
      c = border < 0.045f || border > 0.205f ? gold : cream;
      if (border > 0.055f && border < 0.195f) {
        if (shape < 0.42f) c = dyes[hash(cx, cy, seed + 1) % 6];
        if (shape < 0.27f) c = dyes[hash(cx, cy, seed + 2) % 6];
        if (shape < 0.12f) c = dyes[hash(cx, cy, seed + 3) % 6];
      }
    } else {
      // Medallions of different sizes on a field strewn with small figures.
      c = red;
      const int fx = floor_int(kx / 0.06f), fy = floor_int(ky / 0.06f);
      const float fu = fraction(kx / 0.06f) - 0.5f, fv = fraction(ky / 0.06f) - 0.5f;
      const float figure = hash(fx, fy, seed + 4) % 2 ? std::abs(fu) + std::abs(fv) : std::abs(fu * fv) * 9;
      if (figure < 0.22f + 0.2f * hash01(fx, fy, seed + 5)) c = dyes[hash(fx, fy, seed + 6) % 6];
      for (int m = 0; m < 3; ++m) {
        const float mx = width * (0.25f + 0.25f * static_cast<float>(m)) + 0.05f * (hash01(m, 0, seed + 7) - 0.5f);
        const float d = std::abs(kx - mx) / 0.95f + std::abs(ky - height / 2) / 1.35f +
                        0.012f * static_cast<float>(hash(floor_int(ky / 0.022f), m, seed) % 3);
        const float radius = m == 1 ? 0.36f : 0.25f;
        const int ring = floor_int((radius - d) / 0.045f);
        if (d < radius) c = dyes[hash(m, ring, seed + 8) % 6];
        if (d < radius && ring % 2 == 1 && hash(i / 4, j / 4, seed + 9) % 3 == 0) c = cream;
      }
    }
    const float abrash = 0.14f * fractal(kx * 0.7f, ky * 7, 3, seed + 10);  // bands of unevenly dyed wool
    const float knot = 0.82f + 0.3f * hash01(i, j, seed + 11);
    const float u = 2 * fraction(x / kKnot) - 1, v = 2 * fraction(y / kKnot) - 1;
    return matte(shade(c, (knot + abrash) * (1 - 0.22f * (u * u + v * v))));
  };
}

}  // namespace photoslam::synthetic
