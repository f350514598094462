// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace photoslam::synthetic {

inline uint32_t hash(int32_t x, int32_t y, uint32_t seed) {
  uint32_t h = static_cast<uint32_t>(x) * 0x9E3779B1u ^ static_cast<uint32_t>(y) * 0x85EBCA77u ^ seed * 0xC2B2AE3Du;
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return h ^ (h >> 15);
}

/// Uniform in [0, 1), one value per lattice point.
inline float hash01(int32_t x, int32_t y, uint32_t seed) {
  return static_cast<float>(hash(x, y, seed) >> 8) * 0x1.0p-24f;
}

inline float lerp(float a, float b, float t) { return a + (b - a) * t; }

/// 0 below a, 1 above b, smooth in between.
inline float smoothstep(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

inline int floor_int(float x) {
  const int i = static_cast<int>(x);
  return i - (x < static_cast<float>(i) ? 1 : 0);
}

inline float fraction(float x) { return x - static_cast<float>(floor_int(x)); }

/// Gradient noise with features of size 1, roughly in [-1, 1]. Source: Perlin, "Improving noise", 2002.
inline float noise(float x, float y, uint32_t seed) {
  const int ix = floor_int(x), iy = floor_int(y);
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
  // One of eight directions per corner, chosen without branches: the bits are random.
  const auto corner = [&](int dx, int dy) {
    const uint32_t h = hash(ix + dx, iy + dy, seed);
    const float px = fx - static_cast<float>(dx), py = fy - static_cast<float>(dy);
    const float a = std::bit_cast<float>(std::bit_cast<uint32_t>(px) ^ (h << 31));
    const float b = std::bit_cast<float>(std::bit_cast<uint32_t>(py) ^ (h >> 1 << 31));
    const float tilt = 0.5f * static_cast<float>(static_cast<int>(h >> 2 & 1));
    return (1 - tilt) * a + (0.5f + tilt) * b;
  };
  const float u = fx * fx * fx * (fx * (fx * 6 - 15) + 10), v = fy * fy * fy * (fy * (fy * 6 - 15) + 10);
  return 1.25f * lerp(lerp(corner(0, 0), corner(1, 0), u), lerp(corner(0, 1), corner(1, 1), u), v);
}

/// Sum of noise at doubling frequencies and halving amplitudes, roughly in [-1, 1].
inline float fractal(float x, float y, int octaves, uint32_t seed, float gain = 0.5f) {
  float sum = 0, amplitude = 1, total = 0;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * noise(x, y, seed + static_cast<uint32_t>(i) * 101u);
    total += amplitude;
    amplitude *= gain;
    x = x * 2 + 17.3f;
    y = y * 2 + 5.1f;
  }
  return 1.4f * sum / total;
}

/// Distances to the nearest and second nearest of randomly placed points, one per unit cell, and the nearest's hash.
struct CellNoise {
  float first = 9, second = 9;
  uint32_t id = 0;
};

inline CellNoise cells(float x, float y, uint32_t seed) {
  CellNoise best;
  const int ix = floor_int(x), iy = floor_int(y);
  for (int j = iy - 1; j <= iy + 1; ++j) {
    for (int i = ix - 1; i <= ix + 1; ++i) {
      const float px = static_cast<float>(i) + hash01(i, j, seed), py = static_cast<float>(j) + hash01(i, j, seed + 1);
      const float distance = std::hypot(px - x, py - y);
      if (distance < best.first) {
        best = {distance, best.first, hash(i, j, seed + 2)};
      } else {
        best.second = std::min(best.second, distance);
      }
    }
  }
  return best;
}

}  // namespace photoslam::synthetic
