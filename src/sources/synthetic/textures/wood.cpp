// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/textures/noise.h"
#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {
namespace {

/// Share of dark wood at a point: growth rings cut lengthwise, fibres and pores. Grain along x.
float grain(float x, float y, uint32_t seed) {
  const float warp = 0.05f * fractal(x * 0.9f, y * 5, 3, seed);
  // Rings lie close together where the tree grew slowly.
  const float position = (y + warp) * 17 + 2.6f * fractal(x * 0.5f, y * 9, 3, seed + 1);
  const float ring = fraction(position);
  const float strength = 0.5f + 0.5f * hash01(floor_int(position), 3, seed);
  const float late_wood = smoothstep(0.15f, 0.8f, ring) * (1 - smoothstep(0.88f, 1.0f, ring)) * strength;
  const float fibre = noise(x * 14, y * 420, seed + 2) + 0.6f * noise(x * 40, y * 900, seed + 3);
  const float pores = smoothstep(0.25f, 0.6f, noise(x * 55, y * 500, seed + 4));
  return 0.2f + 0.5f * late_wood + 0.13f * fibre + 0.3f * pores * (0.4f + late_wood) +
         0.12f * fractal(x * 2, y * 5, 2, seed + 5);
}

}  // namespace

Shader wood(const Color& light, const Color& dark, uint32_t seed) {
  return [=](float x, float y) -> Color {
    // A knot every half metre or so bends the grain around itself.
    const CellNoise knot = cells(x * 1.6f, y * 3.2f, seed + 9);
    const float pull = knot.id % 3 == 0 ? 0.03f * std::exp(-knot.first * knot.first * 30) : 0.0f;
    const float core = knot.id % 3 == 0 ? smoothstep(0.055f, 0.02f, knot.first) : 0.0f;
    const float dark_share = std::max(grain(x, y + pull, seed), 0.9f * core);
    const Color c = mix(light, dark, std::clamp(dark_share, 0.0f, 1.2f));
    return {c[0], c[1], c[2], 0.75f + 0.25f * fractal(x * 9, y * 30, 2, seed + 8)};
  };
}

Shader parquet(uint32_t seed) {
  constexpr float kWidth = 0.095f, kLength = 0.75f;
  return [=](float x, float y) -> Color {
    const int row = floor_int(y / kWidth);
    const float shifted = x + kLength * hash01(row, 0, seed);
    const int board = floor_int(shifted / kLength);
    const uint32_t id = hash(row, board, seed + 1);
    const float tone = hash01(row, board, seed + 2);
    const float in_x = shifted - static_cast<float>(board) * kLength, in_y = y - static_cast<float>(row) * kWidth;
    const float dark_share = grain(shifted * 1.3f + 7 * tone, in_y + 5 * hash01(row, board, seed + 3), id % 64);
    Color c = mix(rgb(0xC79A66), rgb(0x7E5230), std::clamp(0.9f * dark_share + 0.5f * (tone - 0.4f), 0.0f, 1.0f));
    c = mix(c, rgb(0x9A6238), 0.35f * hash01(row, board, seed + 4));
    const float edge = std::min({in_x, kLength - in_x, in_y, kWidth - in_y});
    c = shade(c, lerp(0.42f, 1.0f, smoothstep(0.0004f, 0.0028f, edge)));
    c = shade(c, 1 + 0.07f * fractal(x * 1.1f, y * 1.1f, 4, seed + 6));
    const float scratch = smoothstep(0.55f, 0.7f, noise(x * 6 + y * 3, y * 160 - x * 40, seed + 7));
    return {c[0], c[1], c[2], 0.9f - 0.5f * scratch};
  };
}

Shader basket(uint32_t seed) {
  return [=](float x, float y) -> Color {
    constexpr float kPitch = 0.016f;
    const int column = floor_int(x / (2 * kPitch)), row = floor_int(y / kPitch);
    const bool over = (column + row) % 2 == 0;
    const float u = fraction(x / (2 * kPitch)), v = fraction(y / kPitch);
    const float bulge = over ? std::sin(3.14159f * u) : 0.45f + 0.3f * std::abs(u - 0.5f);
    const float round = std::sqrt(std::max(0.0f, 1 - (2 * v - 1) * (2 * v - 1)));
    const float tone = 0.75f + 0.35f * hash01(column, row, seed) + 0.12f * noise(x * 900, y * 120, seed + 1);
    return shade(rgb(0xB8884C, 0.6f), tone * (0.25f + 0.75f * bulge * round));
  };
}

}  // namespace photoslam::synthetic
