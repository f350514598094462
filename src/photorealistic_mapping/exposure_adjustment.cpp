// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/exposure_adjustment.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/check.h"

namespace photoslam {

void ExposureOptions::visit(OptionVisitor& v) {
  v.value({"enabled", "", 0, 0,
           "Learn gain and bias of every keyframe; renders are scored with those of the nearest in time."},
          enabled);
  v.value({"gain_rate", "", 0.0, 1.0, "Step size of Adam for the logarithms of the gains."}, gain_rate);
  v.value({"bias_rate", "", 0.0, 1.0, "Step size of Adam for the biases; 0: gains only."}, bias_rate);
  v.value({"decay", "", 0.0, 1.0, "Share of log gains and biases that every step takes back, against drift."}, decay);
}

splatting::Exposure ExposureAdjustment::exposure() const {
  splatting::Exposure exposure;
  for (size_t c = 0; c < 3; ++c) {
    exposure.gain[c] = static_cast<float>(std::exp(parameters_[c]));
    exposure.bias[c] = static_cast<float>(parameters_[3 + c]);
  }
  return exposure;
}

void ExposureAdjustment::start_from(const splatting::Exposure& exposure) {
  for (size_t c = 0; c < 3; ++c) {
    parameters_[c] = std::log(static_cast<double>(exposure.gain[c]));
    parameters_[3 + c] = static_cast<double>(exposure.bias[c]);
  }
}

void ExposureAdjustment::match(const DepthPicture& picture, const splatting::RenderResult& render) {
  constexpr float kOpaque = 0.9f;  // fresh seeds let more through, and look dark
  constexpr double kMinShare = 0.2, kMaxLogGain = 1.4;
  constexpr double kTrustedError = 0.1;  // where gain * render is off by this share, the ratio counts by half
  const size_t plane = render.alpha.size(), channels = static_cast<size_t>(picture.color.channels());
  const std::span<const uint8_t> values = picture.color.values();
  PHOTOSLAM_CHECK(values.size() == channels * plane, "picture of {} values, render of {} pixels", values.size(), plane);
  std::vector<size_t> opaque;
  for (size_t i = 0; i < plane; ++i) {
    if (render.alpha[i] >= kOpaque && picture.has_data(i)) opaque.push_back(i);
  }
  if (static_cast<double>(opaque.size()) < kMinShare * static_cast<double>(plane)) return;
  for (size_t c = 0; c < 3; ++c) {
    const auto seen_at = [&](size_t i) { return values[channels * i + (channels == 3 ? c : 0)] / 255.0; };
    const auto drawn_at = [&](size_t i) { return static_cast<double>(render.rgb[c * plane + i]); };
    double seen = 0, drawn = 0, error = 0;
    for (const size_t i : opaque) {
      seen += seen_at(i);
      drawn += drawn_at(i);
    }
    if (seen <= 0 || drawn <= 0) continue;
    const double gain = seen / drawn;
    for (const size_t i : opaque) error += std::abs(seen_at(i) - gain * drawn_at(i));
    const double doubt = error / seen / kTrustedError;
    const double log_gain = std::clamp(std::log(gain), -kMaxLogGain, kMaxLogGain);
    parameters_[c] += (log_gain - parameters_[c]) / (1 + doubt * doubt);
    parameters_[3 + c] = 0;
  }
}

void ExposureAdjustment::step(const ExposureOptions& options, double rate_factor, std::span<const float, 6> gradient) {
  constexpr double kBeta1 = 0.9, kBeta2 = 0.99, kEpsilon = 1e-12;
  std::array<double, 6> g{};
  for (size_t i = 0; i < 6; ++i) {
    g[i] = static_cast<double>(gradient[i]) * (i < 3 ? std::exp(parameters_[i]) : 1.0);
    if (!std::isfinite(g[i])) return;
  }
  ++steps_;
  for (size_t i = 0; i < 6; ++i) {
    first_moment_[i] = kBeta1 * first_moment_[i] + (1 - kBeta1) * g[i];
    second_moment_[i] = kBeta2 * second_moment_[i] + (1 - kBeta2) * g[i] * g[i];
    const double mean = first_moment_[i] / (1 - std::pow(kBeta1, steps_));
    const double variance = second_moment_[i] / (1 - std::pow(kBeta2, steps_));
    const double rate = i < 3 ? options.gain_rate : options.bias_rate;
    parameters_[i] *= 1 - rate_factor * options.decay;
    parameters_[i] -= rate_factor * rate * mean / (std::sqrt(variance) + kEpsilon);
  }
}

void apply(const splatting::Exposure& exposure, splatting::RenderResult& render) {
  const size_t plane = render.alpha.size();
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = c * plane; i < (c + 1) * plane; ++i)
      render.rgb[i] = exposure.gain[c] * render.rgb[i] + exposure.bias[c];
  }
}

void remove(const splatting::Exposure& exposure, splatting::Gaussian& gaussian) {
  constexpr float kSh0 = 0.28209479177387814f;  // Y_0
  for (size_t c = 0; c < 3; ++c) {
    const float color = 0.5f + kSh0 * gaussian.sh[0][c];
    gaussian.sh[0][c] = ((color - exposure.bias[c]) / exposure.gain[c] - 0.5f) / kSh0;
  }
}

}  // namespace photoslam
