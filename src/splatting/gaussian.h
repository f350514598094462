// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace photoslam::splatting {

inline constexpr int kMaxShDegree = 3;
inline constexpr int kNumShCoefficients = 16;

/// Gaussians with a parameter, colour or size beyond this (or not a number) are garbage: never drawn, never trained.
inline constexpr float kAbsurd = 1e18f;

/// Number of spherical-harmonic coefficients per colour channel of a degree in [0, 3].
constexpr int num_sh_coefficients(int degree) { return (degree + 1) * (degree + 1); }

/// One gaussian in the frame of its anchor: raw (unactivated) parameters, as 3DGS files hold them.
struct Gaussian {
  float mean[3] = {0, 0, 0};             ///< [m]
  float rotation[4] = {1, 0, 0, 0};      ///< (w, x, y, z), need not be normalised.
  float log_scale[3] = {0, 0, 0};        ///< Natural logarithm of the standard deviations [m].
  float opacity_logit = 0;               ///< Opacity = 1 / (1 + exp(−logit)).
  float sh[kNumShCoefficients][3] = {};  ///< [coefficient][rgb]; colour = max(0, Σ Y_k(direction) sh_k + 1/2).
};

/// Rows of a block's parameter table; a row holds one parameter of all its gaussians.
namespace row {
inline constexpr int kMean = 0;
inline constexpr int kRotation = 3;
inline constexpr int kLogScale = 7;
inline constexpr int kOpacity = 10;
inline constexpr int kSh = 11;  ///< Coefficient k, channel c: kSh + 3 k + c.
inline constexpr int kCount = kSh + 3 * kNumShCoefficients;
}  // namespace row

}  // namespace photoslam::splatting
