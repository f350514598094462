// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace photoslam::synthetic {

/// Red, green, blue and a fourth value that the user defines. In textures the colours are display values, the square
/// roots of linear reflectances (close to sRGB), and the fourth value scales the gloss.
using Color = Eigen::Array4f;

/// From 0xRRGGBB.
inline Color rgb(uint32_t hex, float gloss = 1) {
  const auto channel = [&](int shift) { return static_cast<float>((hex >> shift) & 255) / 255.0f; };
  return {channel(16), channel(8), channel(0), gloss};
}

inline Color mix(const Color& a, const Color& b, float t) { return a + (b - a) * t; }

/// Brightens (> 1) or darkens (< 1) without touching the gloss.
inline Color shade(const Color& c, float factor) { return c * Color(factor, factor, factor, 1); }

/// Fully saturated colours around the wheel, muted by `saturation` and scaled to `value`; all in [0, 1].
inline Color hue(float h, float saturation, float value) {
  const auto channel = [&](float shift) {
    const float k = 6 * (h + shift - std::floor(h + shift));
    return value * (1 - saturation * std::clamp(2.0f - std::abs(k - 3), 0.0f, 1.0f));
  };
  return {channel(0.0f), channel(2.0f / 3), channel(1.0f / 3), 1};
}

}  // namespace photoslam::synthetic
