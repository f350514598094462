// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/checked_file.h"

#include <algorithm>
#include <cstring>

#include "base/check.h"
#include "base/file.h"

namespace photoslam {
namespace {

constexpr size_t kMagicSize = 8;

/// What stands before the content.
struct Header {
  char magic[kMagicSize];
  uint32_t version;
  uint32_t header_check;  ///< Complement of the version.
  uint64_t size;
  uint64_t checksum;
};
static_assert(sizeof(Header) == 32);

}  // namespace

uint64_t checksum(std::string_view bytes) {
  uint64_t hash = 0xCBF29CE484222325ull ^ bytes.size();
  while (!bytes.empty()) {
    uint64_t word = 0;
    const size_t size = std::min(bytes.size(), sizeof(word));
    std::memcpy(&word, bytes.data(), size);
    bytes.remove_prefix(size);
    hash = (hash ^ word) * 0x9E3779B97F4A7C15ull;  // a bijection of the hash for every word
    hash ^= hash >> 32;
  }
  return hash;
}

Status write_checked_file(const std::filesystem::path& path, const FileKind& kind, std::string_view content) {
  PHOTOSLAM_CHECK(kind.magic.size() == kMagicSize, "{}", kind.magic.size());
  Header header{{}, kind.version, ~kind.version, content.size(), checksum(content)};
  std::memcpy(header.magic, kind.magic.data(), kMagicSize);
  return write_file_atomically(path,
                               {std::string_view(reinterpret_cast<const char*>(&header), sizeof(header)), content});
}

Result<std::string> read_checked_file(const std::filesystem::path& path, const FileKind& kind) {
  Result<std::string> file = read_file(path);
  if (!file) return file.error();
  Header header{};
  if (file->size() >= kMagicSize && file->compare(0, kMagicSize, kind.magic) != 0) {
    return error("{} is not a {} file", path.string(), kind.name);
  }
  if (file->size() < sizeof(header)) {
    return error("{} is truncated: {} bytes, not even a header; use another copy", path.string(), file->size());
  }
  std::memcpy(&header, file->data(), sizeof(header));
  if (header.header_check != ~header.version) {
    return error("{} is damaged: its header contradicts itself; use another copy", path.string());
  }
  if (header.version > kind.version) {
    return error("{} has format version {}, this program reads up to {}: use a newer photoslam", path.string(),
                 header.version, kind.version);
  }
  if (header.version < kind.oldest) {
    return error("{} has format version {}, this program reads {} and newer: use the photoslam that wrote it",
                 path.string(), header.version, kind.oldest);
  }
  const size_t size = file->size() - sizeof(header);
  if (size < header.size) {
    return error("{} is truncated: {} of {} bytes; use another copy", path.string(), size, header.size);
  }
  file->erase(0, sizeof(header));
  if (size > header.size || checksum(*file) != header.checksum) {
    return error("{} is damaged: its checksum does not match; use another copy", path.string());
  }
  return file;
}

}  // namespace photoslam
