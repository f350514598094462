// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace photoslam {

/// Writes the whole content or leaves what was there before: temporary file beside it, fsync, rename.
Status write_file_atomically(const std::filesystem::path& path, std::string_view content);
Status write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content);
/// The same for content in pieces, one after the other.
Status write_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> pieces);

/// Reads a whole file; the error names the path and the reason.
Result<std::string> read_file(const std::filesystem::path& path);

/// Creates the folder (and its parents) and checks that files can be written there. Removes what killed processes left
/// behind of their atomic writes.
Status prepare_output_folder(const std::filesystem::path& folder);

}  // namespace photoslam
