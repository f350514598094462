// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace photoslam {

/// zlib counts in 32 bits.
inline constexpr size_t kMostAtOnce = std::numeric_limits<unsigned>::max();

/// Size (8 bytes) and zlib stream, fast: what comes is expected to be differences already, where entropy coding does
/// nearly all there is to gain. `most_at_once`: bytes that zlib is given at a time.
std::string packed(std::string_view bytes, size_t most_at_once = kMostAtOnce);

/// What was packed; nothing if these bytes never were.
std::optional<std::string> unpacked(std::string_view bytes, size_t most_at_once = kMostAtOnce);

}  // namespace photoslam
