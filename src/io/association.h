// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace photoslam {

/// Pairs of indices into two lists of times [ns], both in increasing order: times at most `max_difference_ns` apart,
/// the closest first, each in one pair at most. Sorted by the first index.
std::vector<std::pair<size_t, size_t>> associate_times(std::span<const int64_t> a, std::span<const int64_t> b,
                                                       int64_t max_difference_ns);

}  // namespace photoslam
