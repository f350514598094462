// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace photoslam {

/// What a binary file of ours is.
struct FileKind {
  std::string_view name;   ///< For messages: "session".
  std::string_view magic;  ///< Eight bytes.
  uint32_t version = 1;    ///< That this program writes, and the newest it reads.
  uint32_t oldest = 1;     ///< That it still reads.
};

/// Writes header (magic, version, size, checksum) and content atomically: a crash at any moment leaves the file that
/// was there before.
Status write_checked_file(const std::filesystem::path& path, const FileKind& kind, std::string_view content);

/// The content, exactly as it was written; otherwise an error that tells a missing file, another kind of file, one of a
/// newer program, a truncated and a damaged one apart.
Result<std::string> read_checked_file(const std::filesystem::path& path, const FileKind& kind);

/// 64-bit checksum of bytes; every change of up to eight neighbouring bytes changes it.
uint64_t checksum(std::string_view bytes);

}  // namespace photoslam
