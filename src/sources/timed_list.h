// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "io/text_table.h"

namespace photoslam::internal {

enum class TimeUnit { seconds, nanoseconds };

/// A time as it stands in a list.
Result<int64_t> parse_time(std::string_view text, TimeUnit unit);

/// Calls row(time [ns], line) for every line of a text list whose lines begin with increasing times and have `columns`
/// fields, `layout` naming them. Errors name file and line.
Status read_timed_list(const std::filesystem::path& path, TimeUnit unit, size_t columns, const char* layout,
                       const std::function<void(int64_t, const TextLine&)>& row);

/// Image files with the times at which they were taken, in order.
struct ImageList {
  std::vector<int64_t> times;  // ns
  std::vector<std::filesystem::path> paths;
};

/// Reads lines "time file"; files are relative to `folder`.
Result<ImageList> read_image_list(const std::filesystem::path& path, TimeUnit unit,
                                  const std::filesystem::path& folder);

/// Pairs of indices of images of the same moment. Images of `a` without a partner within `tolerance_ns` are left out
/// and told in `notes`; `what` names the two, as in "colour images have no depth image".
Result<std::vector<std::pair<size_t, size_t>>> match_image_lists(const ImageList& a, const ImageList& b,
                                                                 int64_t tolerance_ns, const std::string& what,
                                                                 std::vector<std::string>& notes);

}  // namespace photoslam::internal
