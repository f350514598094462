// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The oracle of the splatting tests: plain, dense, double precision, written from the formulas and independent of the
// engine (it includes nothing of it).

#include <array>
#include <cstdint>
#include <vector>

namespace photoslam::reference {

/// Mean 3, rotation wxyz 4, log-scale 3, opacity logit 1, colour coefficients [16][rgb].
inline constexpr int kNumParameters = 59;
using Parameters = std::array<double, kNumParameters>;

struct Gaussian {
  Parameters parameters{};
  int anchor = 0;
};

struct Pose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major
  std::array<double, 3> translation{0, 0, 0};
};

struct View {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double near = 0.01;
  int shrink_factor = 1;
  std::array<double, 3> background{0, 0, 0};
  int sh_degree = 3;
  std::vector<Pose> camera_from_anchor;
};

struct Image {
  std::vector<double> rgb;         // [3, H, W]
  std::vector<double> depth;       // [H, W]
  std::vector<double> alpha;       // [H, W]
  std::vector<uint8_t> ambiguous;  // [H, W] a decision here lies within `noise` of its threshold
};

/// `noise`: relative accuracy of the engine's blending weights; decisions closer to their threshold are ambiguous.
Image render(const std::vector<Gaussian>& gaussians, const View& view, double noise = 1e-5);

struct Gradients {
  std::vector<Parameters> parameters;  // per gaussian
  std::array<double, 6> pose{};        // left twist in the camera frame, translation first
};

/// Gradients of L given dL/drgb [3, H, W], dL/ddepth [H, W] and dL/dalpha [H, W].
Gradients backward(const std::vector<Gaussian>& gaussians, const View& view, const std::vector<double>& dl_drgb,
                   const std::vector<double>& dl_ddepth, const std::vector<double>& dl_dalpha);

}  // namespace photoslam::reference
