// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/update_constants.h"

#include <algorithm>
#include <cmath>

#include "splatting/trainer.h"

namespace photoslam::splatting {

UpdateConstants make_update_constants(const TrainOptions& options) {
  UpdateConstants c;
  const LearningRates& rates = options.rates;
  std::fill_n(c.rates + row::kMean, 3, rates.mean);
  std::fill_n(c.rates + row::kRotation, 4, rates.rotation);
  std::fill_n(c.rates + row::kLogScale, 3, rates.log_scale);
  c.rates[row::kOpacity] = rates.opacity;
  std::fill_n(c.rates + row::kSh, 3, rates.sh_dc);
  std::fill(c.rates + row::kSh + 3, c.rates + row::kCount, rates.sh_rest);
  c.beta1 = options.beta1;
  c.beta2 = options.beta2;
  c.epsilon2 = std::max(options.epsilon * options.epsilon, 1e-36f);
  c.log_beta1 = static_cast<float>(std::log(static_cast<double>(options.beta1)));
  c.log_beta2 = static_cast<float>(std::log(static_cast<double>(options.beta2)));
  c.bias_correction = options.bias_correction;
  c.opacity_weight = options.opacity_weight;
  return c;
}

}  // namespace photoslam::splatting
