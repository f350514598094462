// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>

#include "splatting/model.h"

namespace photoslam::splatting {

/// A gaussian born from another.
struct Child {
  uint32_t parent = 0;     ///< Index.
  uint32_t is_half = 0;    ///< Otherwise a clone.
  double normals[3] = {};  ///< Of a half: standard normal numbers.
};

/// Which gaussians go, and which become two: adaptive density control as in 3D Gaussian splatting (Kerbl et al. 2023).
struct DensityRules {
  // By shape: one goes that is more transparent or larger than this, or not finite.
  bool by_shape = false;
  float min_opacity_logit = 0;
  float max_log_scale = 0;
  // By statistics: one goes that so many views saw, but never with more weight in any pixel; of the others those become
  // two whose mean gradient reaches the threshold. Larger ones are split, smaller ones cloned.
  bool by_statistics = false;
  float views_to_judge = 3;
  double min_weight = 0;
  double gradient_threshold = 0;
  double split_log_scale = 0;
};

}  // namespace photoslam::splatting
