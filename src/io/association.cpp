// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/association.h"

#include <algorithm>
#include <tuple>

namespace photoslam {

std::vector<std::pair<size_t, size_t>> associate_times(std::span<const int64_t> a, std::span<const int64_t> b,
                                                       int64_t max_difference_ns) {
  std::vector<std::tuple<int64_t, size_t, size_t>> candidates;
  size_t first = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    while (first < b.size() && b[first] < a[i] - max_difference_ns) ++first;
    for (size_t j = first; j < b.size() && b[j] <= a[i] + max_difference_ns; ++j) {
      candidates.emplace_back(std::max(a[i], b[j]) - std::min(a[i], b[j]), i, j);
    }
  }
  std::ranges::sort(candidates);

  std::vector<bool> a_taken(a.size()), b_taken(b.size());
  std::vector<std::pair<size_t, size_t>> pairs;
  for (const auto& [difference, i, j] : candidates) {
    if (a_taken[i] || b_taken[j]) continue;
    a_taken[i] = b_taken[j] = true;
    pairs.emplace_back(i, j);
  }
  std::ranges::sort(pairs);
  return pairs;
}

}  // namespace photoslam
