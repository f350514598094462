// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "io/gaussian_ply.h"
#include "math/se3.h"
#include "splatting/model.h"

namespace photoslam {

/// Rotates spherical-harmonic coefficients [16][3]: the colour seen along R d afterwards is that along d before.
class ShRotation {
 public:
  explicit ShRotation(const Mat3& rotation);
  void apply(float (&sh)[splatting::kNumShCoefficients][3]) const;

 private:
  Eigen::Matrix<double, 16, 16> matrix_;
};

/// The same gaussian in another frame; `rotation` is that of b_from_a.
splatting::Gaussian transform(const splatting::Gaussian& in_a, const SE3& b_from_a, const ShRotation& rotation);

/// The gaussians in the world frame, as files hold them: means, rotations and spherical harmonics leave the frames of
/// their anchors. Coefficients beyond the model's degree are zero. anchors_from_world: [anchors]. Gaussians of anchors
/// that are 0 in `chosen` [anchors] are left out: they are in another world. Without it all are taken.
GaussianTable to_world(const splatting::GaussianModel& model, std::span<const SE3> anchors_from_world,
                       std::span<const uint8_t> chosen = {});

/// The gaussians of a file as a model with one anchor: the world.
splatting::GaussianModel from_world(const GaussianTable& table);

}  // namespace photoslam
