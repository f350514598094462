// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/gaussian.h"

namespace photoslam::splatting {

struct TrainOptions;

/// What the optimiser needs to know, by row of a block, in the form that its kernels take.
struct UpdateConstants {
  float rates[row::kCount] = {};
  float beta1 = 0, beta2 = 0, epsilon2 = 0;
  float log_beta1 = 0, log_beta2 = 0;
  float opacity_weight = 0;  ///< Of the mean opacity, divided by the number of visible gaussians where it is known.
  bool bias_correction = false;
};

UpdateConstants make_update_constants(const TrainOptions& options);

}  // namespace photoslam::splatting
