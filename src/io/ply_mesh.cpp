// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "io/mesh_file.h"
#include "io/text_table.h"

namespace photoslam::internal {
namespace {

struct Property {
  std::string name = {};
  char kind = 'i';  ///< i: signed, u: unsigned, f: floating point.
  size_t size = 0;
  size_t count_size = 0;  ///< Bytes of a list's (unsigned) length; 0: no list.
};

struct Element {
  std::string name;
  size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  bool ascii = false;
  std::vector<Element> elements;
  std::string_view data;
};

std::optional<Property> property_of(std::string_view type) {
  const auto is = [&](std::string_view a, std::string_view b) { return type == a || type == b; };
  if (is("char", "int8")) return Property{.kind = 'i', .size = 1};
  if (is("uchar", "uint8")) return Property{.kind = 'u', .size = 1};
  if (is("short", "int16")) return Property{.kind = 'i', .size = 2};
  if (is("ushort", "uint16")) return Property{.kind = 'u', .size = 2};
  if (is("int", "int32")) return Property{.kind = 'i', .size = 4};
  if (is("uint", "uint32")) return Property{.kind = 'u', .size = 4};
  if (is("float", "float32")) return Property{.kind = 'f', .size = 4};
  if (is("double", "float64")) return Property{.kind = 'f', .size = 8};
  return std::nullopt;
}

Status accept_property(const std::vector<std::string_view>& fields, Element& element) {
  const bool list = fields.size() == 5 && fields[1] == "list";
  if (!list && fields.size() != 3) return error("expected 'property <type> <name>' or a list");
  std::optional<Property> property = property_of(fields[list ? 3 : 1]);
  if (!property) return error("unknown type '{}'", fields[list ? 3 : 1].substr(0, 40));
  if (list) {
    const std::optional<Property> count = property_of(fields[2]);
    if (!count || count->kind == 'f') return error("'{}' cannot count a list", fields[2].substr(0, 40));
    property->count_size = count->size;
  }
  property->name = fields.back();
  element.properties.push_back(std::move(*property));
  return {};
}

Status accept(const std::vector<std::string_view>& fields, Header& header) {
  if (fields[0] == "format") {
    header.ascii = fields.size() > 1 && fields[1] == "ascii";
    if (!header.ascii && (fields.size() < 2 || fields[1] != "binary_little_endian"))
      return error("only the formats ascii and binary_little_endian can be read");
  } else if (fields[0] == "element") {
    size_t count = 0;
    if (fields.size() != 3 ||
        std::from_chars(fields[2].data(), fields[2].data() + fields[2].size(), count).ec != std::errc())
      return error("expected 'element <name> <count>'");
    header.elements.push_back({std::string(fields[1]), count, {}});
  } else if (fields[0] == "property") {
    if (header.elements.empty()) return error("a property before any element");
    return accept_property(fields, header.elements.back());
  }
  return {};
}

Result<Header> parse_header(std::string_view content) {
  const size_t last = content.find("\nend_header");
  const size_t end = last == std::string_view::npos ? last : content.find('\n', last + 1);
  if (end == std::string_view::npos) return error("the PLY header has no end");
  Header header;
  for (const TextLine& line : split_table(content.substr(0, last))) {
    if (Status status = accept(line.fields, header); !status)
      return error("line {}: {}", line.number, status.error().message);
  }
  header.data = content.substr(end + 1);
  return header;
}

/// Takes one value after another off the data, text or bytes.
class Values {
 public:
  Values(std::string_view data, bool ascii) : data_(data), ascii_(ascii) {}

  /// NaN, and failed() from then on, where the data end or hold no number.
  double next(char kind, size_t size) {
    if (ascii_) return next_text();
    if (data_.size() < size) return fail();
    const double value = decode(kind, size);
    data_.remove_prefix(size);
    return value;
  }
  bool failed() const { return failed_; }
  size_t left() const { return data_.size(); }

 private:
  double fail() {
    failed_ = true;
    return std::numeric_limits<double>::quiet_NaN();
  }
  double next_text() {
    constexpr std::string_view kBlanks = " \t\r\n";
    data_.remove_prefix(std::min(data_.find_first_not_of(kBlanks), data_.size()));
    const std::string_view word = data_.substr(0, data_.find_first_of(kBlanks));
    const Result<double> value = parse_number(word);
    if (!value) return fail();
    data_.remove_prefix(word.size());
    return *value;
  }
  template <class T>
  double as() const {
    T value;
    std::memcpy(&value, data_.data(), sizeof(T));
    return static_cast<double>(value);
  }
  double decode(char kind, size_t size) const {
    if (kind == 'f') return size == 4 ? as<float>() : as<double>();
    if (kind == 'u') return size == 1 ? as<uint8_t>() : size == 2 ? as<uint16_t>() : as<uint32_t>();
    return size == 1 ? as<int8_t>() : size == 2 ? as<int16_t>() : as<int32_t>();
  }

  std::string_view data_;
  bool ascii_, failed_ = false;
};

/// One row; lists longer than the data can hold fail. `take(property, value)` is called for every value.
template <class Take>
bool read_row(const Element& element, Values& values, const Take& take) {
  for (const Property& property : element.properties) {
    size_t count = 1;
    if (property.count_size > 0) {
      const double given = values.next('u', property.count_size);
      if (values.failed() || given < 0 || given > static_cast<double>(values.left())) return false;
      count = static_cast<size_t>(given);
    }
    for (size_t i = 0; i < count; ++i) take(property, values.next(property.kind, property.size));
    if (values.failed()) return false;
  }
  return true;
}

Status read_vertices(const Element& element, Values& values, MeshFile& mesh) {
  constexpr std::array<std::string_view, 6> kNames = {"x", "y", "z", "red", "green", "blue"};
  for (const std::string_view name : kNames) {
    if (std::ranges::find(element.properties, name, &Property::name) == element.properties.end())
      return error("the vertices have no property '{}'; a mesh to film needs colours at its vertices", name);
  }
  for (size_t row = 0; row < element.count; ++row) {
    std::array<float, 6> v{};
    const bool complete = read_row(element, values, [&](const Property& property, double value) {
      const auto at = static_cast<size_t>(std::ranges::find(kNames, property.name) - kNames.begin());
      if (at < v.size()) v[at] = static_cast<float>(at >= 3 && property.kind != 'f' ? value / 255.0 : value);
    });
    if (!complete) return error("the data end, or hold no number, at vertex {} of {}", row, element.count);
    mesh.positions.emplace_back(v[0], v[1], v[2]);
    mesh.colors.emplace_back(v[3], v[4], v[5]);
    mesh.uvs.emplace_back(0.0f, 0.0f);
  }
  return {};
}

Status read_faces(const Element& element, Values& values, MeshFile& mesh) {
  const auto is_corners = [](const Property& p) {
    return p.count_size > 0 && (p.name == "vertex_indices" || p.name == "vertex_index");
  };
  if (std::ranges::none_of(element.properties, is_corners)) return error("the faces have no list 'vertex_indices'");
  MeshFile::Part part;
  for (size_t row = 0; row < element.count; ++row) {
    std::vector<double> corners;
    const bool complete = read_row(element, values, [&](const Property& property, double value) {
      if (is_corners(property)) corners.push_back(value);
    });
    if (!complete) return error("the data end, or hold no number, at face {} of {}", row, element.count);
    for (const double corner : corners) {
      if (!(corner >= 0 && corner < static_cast<double>(mesh.positions.size())))
        return error("face {} names vertex {}, but there are {}", row, corner, mesh.positions.size());
    }
    for (size_t i = 2; i < corners.size(); ++i) {
      part.triangles.push_back({static_cast<uint32_t>(corners[0]), static_cast<uint32_t>(corners[i - 1]),
                                static_cast<uint32_t>(corners[i])});
    }
  }
  mesh.parts.push_back(std::move(part));
  return {};
}

}  // namespace

Result<MeshFile> parse_ply_mesh(std::string_view content) {
  const Result<Header> header = parse_header(content);
  if (!header) return header.error();
  MeshFile mesh;
  Values values(header->data, header->ascii);
  for (const Element& element : header->elements) {
    Status status;
    if (element.name == "vertex") {
      status = read_vertices(element, values, mesh);
    } else if (element.name == "face") {
      status = read_faces(element, values, mesh);
      break;
    }
    if (!status) return status.error();
  }
  return mesh;
}

}  // namespace photoslam::internal
