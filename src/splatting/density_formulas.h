// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What becomes of gaussians between iterations, for host and device alike.

#include "splatting/density.h"
#include "splatting/formulas.h"

namespace photoslam::splatting {

PHOTOSLAM_FORMULA Fate judge(const DensityRules& rules, const Block& block, int lane) {
  const float* const scales = &block.parameters[row::kLogScale][lane];
  const float largest = scalar::maximum(scales[0], scalar::maximum(scales[kBlockSize], scales[2 * kBlockSize]));
  if (rules.by_shape) {
    const float opacity = block.parameters[row::kOpacity][lane];
    float sum = largest + opacity;
    for (int i = 0; i < 3; ++i) sum += block.parameters[row::kMean + i][lane];
    const bool finite = sum - sum == 0;
    if (!finite || opacity < rules.min_opacity_logit || largest > rules.max_log_scale) return Fate::goes;
  }
  if (!rules.by_statistics) return Fate::stays;
  const float views = block.visible[lane];
  const bool idle = static_cast<double>(block.max_weight[lane]) < rules.min_weight;
  if (views >= rules.views_to_judge && idle) return Fate::goes;
  if (views < 1 || static_cast<double>(block.gradient[lane] / views) < rules.gradient_threshold) return Fate::stays;
  return static_cast<double>(largest) > rules.split_log_scale ? Fate::splits : Fate::clones;
}

/// Makes of a gaussian one of the two that it is split into: drawn from it, and 1.6 times smaller. Row r of its
/// parameters is at parameters[stride * r].
PHOTOSLAM_FORMULA void halve(const double* normals, float* parameters, int stride) {
  constexpr float kLogShrink = 0.470003629f;  // log 1.6
  double q[4], norm2 = 0, rotation[9], offset[3];
  for (int i = 0; i < 4; ++i) q[i] = static_cast<double>(parameters[stride * (row::kRotation + i)]);
  for (int i = 0; i < 4; ++i) norm2 += q[i] * q[i];
  for (int i = 0; i < 4; ++i) q[i] /= scalar::square_root(norm2);
  scalar::rotation_matrix(q, rotation);
  for (int i = 0; i < 3; ++i) {
    float& log_scale = parameters[stride * (row::kLogScale + i)];
    offset[i] = normals[i] * scalar::exponential(static_cast<double>(log_scale));
    log_scale -= kLogShrink;
  }
  for (int i = 0; i < 3; ++i)
    parameters[stride * (row::kMean + i)] += static_cast<float>(scalar::dot3(rotation + 3 * i, offset));
}

}  // namespace photoslam::splatting
