// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/npy_file.h"

#include <bit>
#include <string>

#include "base/file.h"

namespace photoslam {

Status write_npy(const std::filesystem::path& path, const ImageF& image) {
  static_assert(std::endian::native == std::endian::little);
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}), }}",
                                   image.height(), image.width(), image.channels());
  constexpr size_t kPreamble = 10, kAlignment = 64;  // magic, version and length; the data starts aligned
  header.append(kAlignment - (kPreamble + header.size() + 1) % kAlignment, ' ');
  header += '\n';
  std::string content("\x93NUMPY\x01\x00", 8);
  content += static_cast<char>(header.size() & 0xff);
  content += static_cast<char>(header.size() >> 8);
  content += header;
  const auto bytes = std::as_bytes(image.values());
  content.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return write_file_atomically(path, content);
}

}  // namespace photoslam
