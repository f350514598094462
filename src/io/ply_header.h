// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace photoslam {

/// A fixed-size property of a PLY element.
struct PlyProperty {
  std::string name;
  size_t offset = 0;  ///< In bytes from the start of a row.
  bool is_float = false;
};

struct PlyElement {
  size_t count = 0;
  size_t stride = 0;  ///< Bytes of a row, at least 1.
  std::vector<PlyProperty> properties;

  /// nullptr when there is none of that name.
  const PlyProperty* find(std::string_view name) const;
};

struct PlyHeader {
  PlyElement vertex;
  size_t data_begin = 0;  ///< Where the vertices begin in the file.
};

/// Parses the header of a binary little-endian PLY file whose first element is `vertex`; elements behind it are
/// ignored. Errors name the line.
Result<PlyHeader> parse_ply_header(std::string_view content);

}  // namespace photoslam
