// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace photoslam {

/// Smallest number of inserted, deleted, replaced or swapped neighbouring characters that turns a into b.
int edit_distance(std::string_view a, std::string_view b);

/// The name a user probably meant: the candidate nearest to `typed`, or "" when none is close enough to be a slip.
std::string nearest_name(std::string_view typed, std::span<const std::string> candidates);

}  // namespace photoslam
