// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

#include "io/text_table.h"

namespace photoslam {
namespace {

using Fields = std::vector<std::string_view>;

size_t type_size(std::string_view type) {
  constexpr std::array<std::pair<std::string_view, size_t>, 16> kTypes = {{{"char", 1},
                                                                           {"int8", 1},
                                                                           {"uchar", 1},
                                                                           {"uint8", 1},
                                                                           {"short", 2},
                                                                           {"int16", 2},
                                                                           {"ushort", 2},
                                                                           {"uint16", 2},
                                                                           {"int", 4},
                                                                           {"int32", 4},
                                                                           {"uint", 4},
                                                                           {"uint32", 4},
                                                                           {"float", 4},
                                                                           {"float32", 4},
                                                                           {"double", 8},
                                                                           {"float64", 8}}};
  const auto* const entry = std::ranges::find(kTypes, type, &std::pair<std::string_view, size_t>::first);
  return entry == kTypes.end() ? 0 : entry->second;
}

/// Reads the header's statements one after another.
class HeaderParser {
 public:
  Status accept(const Fields& fields) {
    const std::string_view keyword = fields[0];
    if (keyword == "comment" || keyword == "obj_info") return {};
    if (keyword == "format") return accept_format(fields);
    if (keyword == "element") return accept_element(fields);
    if (keyword == "property") return accept_property(fields);
    return error("unknown keyword '{}'", keyword.substr(0, 40));
  }

  Result<PlyElement> finish() && {
    if (!has_format_) return error("the header names no format");
    if (num_elements_ == 0) return error("the header names no element 'vertex'");
    if (vertex_.stride == 0) return error("the element 'vertex' has no properties");
    return std::move(vertex_);
  }

 private:
  Status accept_format(const Fields& fields) {
    if (fields.size() != 3 || fields[1] != "binary_little_endian") {
      return error("only the format 'binary_little_endian 1.0' can be read");
    }
    has_format_ = true;
    return {};
  }

  Status accept_element(const Fields& fields) {
    if (++num_elements_ > 1) return {};
    if (fields.size() != 3) return error("expected 'element <name> <count>'");
    if (fields[1] == "chunk") return error("this is SuperSplat's compressed layout; export it uncompressed");
    if (fields[1] != "vertex") return error("the first element must be 'vertex', found '{}'", fields[1].substr(0, 40));
    const char* const last = fields[2].data() + fields[2].size();
    const auto [end, code] = std::from_chars(fields[2].data(), last, vertex_.count);
    if (code != std::errc() || end != last) return error("'{}' is not a number of vertices", fields[2].substr(0, 40));
    return {};
  }

  Status accept_property(const Fields& fields) {
    if (num_elements_ == 0) return error("a property before any element");
    if (num_elements_ > 1) return {};
    if (fields.size() != 3) return error("expected 'property <type> <name>' (no lists)");
    const size_t size = type_size(fields[1]);
    if (size == 0) return error("unknown type '{}'", fields[1].substr(0, 40));
    if (vertex_.find(fields[2]) != nullptr) return error("a second property '{}'", fields[2].substr(0, 40));
    const bool is_float = fields[1] == "float" || fields[1] == "float32";
    vertex_.properties.push_back({std::string(fields[2]), vertex_.stride, is_float});
    vertex_.stride += size;
    return {};
  }

  bool has_format_ = false;
  int num_elements_ = 0;
  PlyElement vertex_;
};

}  // namespace

const PlyProperty* PlyElement::find(std::string_view name) const {
  const auto property = std::ranges::find(properties, name, &PlyProperty::name);
  return property == properties.end() ? nullptr : &*property;
}

Result<PlyHeader> parse_ply_header(std::string_view content) {
  constexpr size_t kLongestHeader = 64 * 1024;
  const std::string_view beginning = content.substr(0, kLongestHeader);
  if (!beginning.starts_with("ply\n") && !beginning.starts_with("ply\r\n")) return error("not a PLY file");
  size_t end = beginning.find("\nend_header");
  if (end != std::string_view::npos) end = beginning.find('\n', end + 1);
  if (end == std::string_view::npos) return error("the PLY header has no end");

  HeaderParser parser;
  for (const TextLine& line : split_table(beginning.substr(0, end))) {
    const bool is_frame = line.number == 1 || line.fields[0] == "end_header";
    if (is_frame) continue;
    const Status status = parser.accept(line.fields);
    if (!status) return error("line {}: {}", line.number, status.error().message);
  }
  Result<PlyElement> vertex = std::move(parser).finish();
  if (!vertex) return vertex.error();
  return PlyHeader{std::move(*vertex), end + 1};
}

}  // namespace photoslam
