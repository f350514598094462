// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/synthetic/textures/noise.h"

namespace photoslam::synthetic {

/// Ink, in [0, 1], of a letter-like mark that fills the box [0, 0.62] x [0, 1]: three strokes between six places.
inline float glyph(float x, float y, uint32_t id) {
  float nearest = 9;
  for (uint32_t stroke = 0; stroke < 3; ++stroke) {
    const uint32_t from = (id >> (5 * stroke)) % 6, to = (from + 1 + (id >> (5 * stroke + 3)) % 5) % 6;
    const float ax = 0.1f + 0.42f * static_cast<float>(from % 2), ay = 0.08f + 0.42f * static_cast<float>(from / 2);
    const float dx = 0.1f + 0.42f * static_cast<float>(to % 2) - ax,
                dy = 0.08f + 0.42f * static_cast<float>(to / 2) - ay;
    const float t = std::clamp(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0.0f, 1.0f);
    nearest = std::min(nearest, std::hypot(x - ax - t * dx, y - ay - t * dy));
  }
  return smoothstep(0.11f, 0.06f, nearest);
}

/// Ink of an endless line of words in letters of height `size`, from (0, 0) to the right.
inline float glyph_line(float x, float y, float size, uint32_t seed) {
  if (y < 0 || y > size || x < 0) return 0;
  const float pitch = 0.72f * size;
  const int place = floor_int(x / pitch);
  if (hash(place, 17, seed) % 6 == 0) return 0;  // between words
  return glyph((x - static_cast<float>(place) * pitch) / size, y / size, hash(place, 0, seed));
}

}  // namespace photoslam::synthetic
