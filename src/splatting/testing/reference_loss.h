// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The oracle of the photometric loss: the definition, in double precision, windows by brute force. Includes nothing of
// the engine.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/random.h"

namespace photoslam::reference {

struct LossCase {
  int width = 0, height = 0;
  std::vector<double> render = {};   // [3, H, W]
  std::vector<uint8_t> target = {};  // [H, W, 3]
  std::vector<uint8_t> mask = {};    // [H, W] or empty
  float gain[3] = {1, 1, 1}, bias[3] = {0, 0, 0};

  size_t plane() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

inline LossCase make_loss_case(int width, int height, bool masked, uint64_t seed) {
  Random random(seed);
  LossCase c{width, height};
  for (size_t i = 0; i < 3 * c.plane(); ++i) {
    const double smooth = 0.5 + 0.4 * std::sin(0.1 * static_cast<double>(i % static_cast<size_t>(width)));
    c.target.push_back(static_cast<uint8_t>(255 * std::clamp(smooth + 0.1 * random.normal(), 0.0, 1.0)));
    // Floats, and never close to the target: the absolute value has a kink there.
    c.render.push_back(static_cast<float>(smooth + 0.02 * random.normal()));
  }
  for (size_t i = 0; masked && i < c.plane(); ++i) c.mask.push_back(random.uniform() < 0.8 ? 255 : 0);
  constexpr float kGain[3] = {1.1f, 0.9f, 1.05f}, kBias[3] = {0.02f, -0.01f, 0.03f};
  if (masked) {
    std::copy_n(kGain, 3, c.gain);
    std::copy_n(kBias, 3, c.bias);
  }
  return c;
}

/// (1 − λ) L1 + λ (1 − SSIM).
inline double photometric_loss(const LossCase& c, double lambda, const std::vector<double>& render,
                               double* ssim_out = nullptr) {
  const int w = c.width, h = c.height;
  double weights[11], norm = 0;
  for (int k = 0; k < 11; ++k) norm += weights[k] = std::exp(-(k - 5) * (k - 5) / (2 * 1.5 * 1.5));
  for (double& weight : weights) weight /= norm;
  double l1 = 0, ssim = 0, count = 0;
  for (size_t ch = 0; ch < 3; ++ch) {
    const auto valid = [&](int x, int y) {
      return x >= 0 && x < w && y >= 0 && y < h && (c.mask.empty() || c.mask[static_cast<size_t>(y * w + x)] != 0);
    };
    const auto a = [&](int x, int y) {
      return valid(x, y) ? static_cast<double>(c.gain[ch]) * render[ch * c.plane() + static_cast<size_t>(y * w + x)] +
                               static_cast<double>(c.bias[ch])
                         : 0.0;
    };
    const auto b = [&](int x, int y) {
      return valid(x, y) ? c.target[static_cast<size_t>(y * w + x) * 3 + ch] / 255.0 : 0.0;
    };
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        if (!valid(x, y)) continue;
        ++count;
        l1 += std::abs(a(x, y) - b(x, y));
        double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
        for (int j = -5; j <= 5; ++j)
          for (int i = -5; i <= 5; ++i) {
            const double k = weights[i + 5] * weights[j + 5], va = a(x + i, y + j), vb = b(x + i, y + j);
            ma += k * va;
            mb += k * vb;
            aa += k * va * va;
            bb += k * vb * vb;
            ab += k * va * vb;
          }
        const double c1 = 1e-4, c2 = 9e-4;
        ssim += (2 * ma * mb + c1) * (2 * (ab - ma * mb) + c2) /
                ((ma * ma + mb * mb + c1) * (aa - ma * ma + bb - mb * mb + c2));
      }
  }
  if (ssim_out != nullptr) *ssim_out = ssim / count;
  return (1 - lambda) * l1 / count + lambda * (1 - ssim / count);
}

/// How far a gradient image [3, H, W] lies from central differences, at some pixels: relative L2 distance.
inline double gradient_error(const LossCase& c, double lambda, const std::vector<float>& gradient) {
  constexpr double kStep = 1e-5;
  Random random(8);
  double difference = 0, norm = 0;
  for (int probe = 0; probe < 12; ++probe) {
    const size_t i = static_cast<size_t>(random.index(static_cast<int>(c.render.size())));
    std::vector<double> plus = c.render, minus = c.render;
    plus[i] += kStep;
    minus[i] -= kStep;
    const double numeric = (photometric_loss(c, lambda, plus) - photometric_loss(c, lambda, minus)) / (2 * kStep);
    difference += std::pow(numeric - static_cast<double>(gradient[i]), 2);
    norm += numeric * numeric;
  }
  return std::sqrt(difference / norm);
}

}  // namespace photoslam::reference
