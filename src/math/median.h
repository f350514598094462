// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "base/check.h"

namespace photoslam {

/// The middle value of at least one; of an even number the lower of the two in the middle. Reorders `values`.
template <class T>
T lower_median(std::vector<T>& values) {
  PHOTOSLAM_CHECK(!values.empty(), "the median of nothing");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace photoslam
