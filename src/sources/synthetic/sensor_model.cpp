// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/sensor_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/random.h"

namespace photoslam {
namespace {

/// Display value in [0, 255] of a linear value: sRGB, with more contrast as cameras have it, and a shoulder that keeps
/// bright windows from clipping hard.
float display_value(float linear) {
  constexpr float kKnee = 0.6f, kMiddle = 0.18f, kContrast = 1.15f;
  const float x = kMiddle * std::pow(std::max(linear, 0.0f) / kMiddle, kContrast);
  const float compressed = x <= kKnee ? x : kKnee + (1 - kKnee) * (1 - std::exp(-(x - kKnee) / (1 - kKnee)));
  const float srgb = compressed <= 0.0031308f ? 12.92f * compressed : 1.055f * std::pow(compressed, 1 / 2.4f) - 0.055f;
  return 255 * srgb;
}

/// display_value for the square root of its argument, tabulated: smooth there, while steep near 0 in the argument.
class ToneCurve {
 public:
  ToneCurve() {
    for (size_t i = 0; i < table_.size(); ++i) {
      const float root = static_cast<float>(i) * kRange / kSteps;
      table_[i] = display_value(root * root);
    }
  }
  float operator()(float linear) const {
    const float at = std::min(std::sqrt(std::max(linear, 0.0f)), kRange) * (kSteps / kRange);
    const size_t i = std::min(static_cast<size_t>(at), table_.size() - 2);
    return table_[i] + (at - static_cast<float>(i)) * (table_[i + 1] - table_[i]);
  }

 private:
  static constexpr float kRange = 2, kSteps = 2048;
  std::array<float, 2049> table_;
};

/// Nearly normal noise of unit variance from one random number: the sum of four uniform 16-bit parts.
float bell(uint64_t bits) {
  int sum = 0;
  for (int i = 0; i < 4; ++i) sum += static_cast<int>(bits >> (16 * i) & 0xFFFF);
  return (static_cast<float>(sum) - 2 * 65535.0f) / (65536.0f * 0.57735f);
}

uint64_t row_seed(uint64_t seed, int y) {
  return Random(seed + static_cast<uint64_t>(y) * 0x2545F4914F6CDD1Dull).next();
}

}  // namespace

ImageU8 expose(const SceneView& view, double exposure_ev, double noise, uint64_t noise_seed) {
  const int width = view.radiance.width(), height = view.radiance.height();
  const float gain = static_cast<float>(std::exp2(exposure_ev)), sigma = static_cast<float>(noise);
  const ToneCurve curve;
  ImageU8 image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    Random random(row_seed(noise_seed, y));
    for (int x = 0; x < 3 * width; ++x) {
      float value = curve(gain * view.radiance.row(y)[x]);
      if (sigma > 0) {
        // Photon noise as it looks after the tone curve: σ at mid-grey, 0.6 σ in the shadows, 1.2 σ in the lights.
        value += sigma * (0.6f + 0.6f * std::sqrt(value / 255)) * 0.97f * bell(random.next());
      }
      image.row(y)[x] = static_cast<uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
    }
  }
  return image;
}

ImageU16 measure_depth(const SceneView& view, double metres_per_unit, double noise, double holes, uint64_t noise_seed) {
  const int width = view.depth.width(), height = view.depth.height();
  ImageU16 image(width, height);
  const auto at_edge = [&](int x, int y) {
    const float z = view.depth(x, y);
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const int nx = std::clamp(x + dx, 0, width - 1), ny = std::clamp(y + dy, 0, height - 1);
      if (std::abs(view.depth(nx, ny) - z) > 0.04f * z) return true;
    }
    return false;
  };
  for (int y = 0; y < height; ++y) {
    Random random(row_seed(noise_seed, y));
    for (int x = 0; x < width; ++x) {
      const double z = view.depth(x, y);
      const double chance = random.uniform();
      const float error = bell(random.next());
      const bool weak = view.incidence(x, y) < 0.14f || at_edge(x, y);
      if (z <= 0 || (weak && chance < holes)) continue;
      const double units = std::round((z + noise * z * z * error) / metres_per_unit);
      if (units >= 1 && units <= 65535) image(x, y) = static_cast<uint16_t>(units);
    }
  }
  return image;
}

}  // namespace photoslam
