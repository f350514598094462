// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace photoslam {

/// Summary of at least one value.
struct Description {
  double mean = 0;
  double standard_deviation = 0;  ///< Of the values themselves (divided by their number).
  double min = 0;
  double max = 0;
};

Description describe(const std::vector<double>& values);

/// Value below which the share `p` in [0, 1] of the values lies, interpolated linearly between neighbours; the values
/// may be unsorted and must not be empty.
double percentile(std::vector<double> values, double p);

}  // namespace photoslam
