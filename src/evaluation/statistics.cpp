// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/check.h"

namespace photoslam {

Description describe(const std::vector<double>& values) {
  PHOTOSLAM_CHECK(!values.empty());
  const auto count = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  double squares = 0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  const auto [min, max] = std::ranges::minmax(values);
  return {mean, std::sqrt(squares / count), min, max};
}

double percentile(std::vector<double> values, double p) {
  PHOTOSLAM_CHECK(!values.empty() && p >= 0 && p <= 1, "{} values, p = {}", values.size(), p);
  const double position = p * static_cast<double>(values.size() - 1);
  const auto below = values.begin() + static_cast<std::ptrdiff_t>(position);
  std::nth_element(values.begin(), below, values.end());
  if (below + 1 == values.end()) return *below;
  const double next = *std::min_element(below + 1, values.end());
  return *below + (position - std::floor(position)) * (next - *below);
}

}  // namespace photoslam
