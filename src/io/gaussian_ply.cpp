// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/gaussian_ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "base/check.h"
#include "base/file.h"
#include "io/ply_header.h"

namespace photoslam {
namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in memory");

constexpr size_t kNormals = 3;
constexpr size_t kProperties = GaussianTable::kColumns + kNormals;
constexpr size_t kRestPerChannel = 15;

/// The property names in the order of GaussianTable's columns.
std::vector<std::string> column_names() {
  std::vector<std::string> names = {"x", "y", "z"};
  const auto add = [&](const char* prefix, size_t count) {
    for (size_t i = 0; i < count; ++i) names.push_back(fmt::format("{}{}", prefix, i));
  };
  add("f_dc_", 3);
  add("f_rest_", 3 * kRestPerChannel);
  names.push_back("opacity");
  add("scale_", 3);
  add("rot_", 4);
  return names;
}

std::string file_header(size_t count) {
  std::string header = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", count);
  std::vector<std::string> names = column_names();
  names.insert(names.begin() + 3, {"nx", "ny", "nz"});
  for (const std::string& name : names) header += fmt::format("property float {}\n", name);
  return header + "end_header\n";
}

/// Column that f_rest_<index> of a file with `rest_count` of them belongs to.
size_t rest_column(size_t index, size_t rest_count) {
  const size_t per_channel = rest_count / 3;
  return GaussianTable::kShRest + index / per_channel * kRestPerChannel + index % per_channel;
}

/// Where a value lies in a row of the file and which column it goes to.
struct ColumnSource {
  size_t offset = 0;
  size_t column = 0;
};

/// Number of f_rest_* properties: all of a spherical-harmonics degree.
Result<size_t> count_rest(const PlyElement& vertex) {
  size_t count = 0;
  while (vertex.find(fmt::format("f_rest_{}", count)) != nullptr) ++count;
  if (count != 0 && count != 9 && count != 24 && count != 45) {
    return error("{} properties f_rest_*; expected 0, 9, 24 or 45", count);
  }
  return count;
}

Result<std::vector<ColumnSource>> locate_columns(const PlyElement& vertex) {
  const Result<size_t> rest_count = count_rest(vertex);
  if (!rest_count) return rest_count.error();
  const std::vector<std::string> names = column_names();
  std::vector<ColumnSource> sources;
  for (size_t column = 0; column < names.size(); ++column) {
    const size_t rest_index = column - GaussianTable::kShRest;
    const bool is_rest = column >= GaussianTable::kShRest && column < GaussianTable::kOpacity;
    if (is_rest && rest_index >= *rest_count) continue;
    const PlyProperty* property = vertex.find(names[column]);
    if (property == nullptr) return error("the property {} is missing; is it a gaussian splatting map?", names[column]);
    if (!property->is_float) return error("the property {} is not of type float", names[column]);
    sources.push_back({property->offset, is_rest ? rest_column(rest_index, *rest_count) : column});
  }
  return sources;
}

Result<GaussianTable> parse(std::string_view content) {
  const Result<PlyHeader> header = parse_ply_header(content);
  if (!header) return header.error();
  const PlyElement& vertex = header->vertex;
  const Result<std::vector<ColumnSource>> sources = locate_columns(vertex);
  if (!sources) return sources.error();

  const std::string_view data = content.substr(header->data_begin);
  if (vertex.count > data.size() / vertex.stride) {
    return error("the header promises {} gaussians, the data ends after {}", vertex.count, data.size() / vertex.stride);
  }
  GaussianTable table;
  table.resize(vertex.count);
  for (size_t i = 0; i < vertex.count; ++i) {
    const char* const source = data.data() + i * vertex.stride;
    float* const target = table.row(i).data();
    for (const auto& [offset, column] : *sources) std::memcpy(target + column, source + offset, sizeof(float));
  }
  return table;
}

}  // namespace

Result<GaussianPlyReport> write_gaussian_ply(const std::filesystem::path& path, const GaussianTable& gaussians) {
  PHOTOSLAM_CHECK(gaussians.values.size() % GaussianTable::kColumns == 0, "{} values", gaussians.values.size());
  std::vector<size_t> finite;
  finite.reserve(gaussians.size());
  for (size_t i = 0; i < gaussians.size(); ++i) {
    if (std::ranges::all_of(gaussians.row(i), [](float v) { return std::isfinite(v); })) finite.push_back(i);
  }

  std::string content = file_header(finite.size());
  const size_t data_begin = content.size();
  content.resize(data_begin + finite.size() * kProperties * sizeof(float));
  char* target = content.data() + data_begin;
  for (const size_t i : finite) {
    const auto row = gaussians.row(i);
    std::array<float, kProperties> properties{};
    std::ranges::copy(row.first<3>(), properties.begin());
    std::ranges::copy(row.subspan<3>(), properties.begin() + 3 + kNormals);
    std::memcpy(target, properties.data(), sizeof(properties));
    target += sizeof(properties);
  }
  if (const Status status = write_file_atomically(path, content); !status) return status.error();
  return GaussianPlyReport{finite.size(), gaussians.size() - finite.size()};
}

Result<GaussianTable> read_gaussian_ply(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  Result<GaussianTable> table = parse(*content);
  if (!table) return error("{}: {}", path.string(), table.error().message);
  return table;
}

}  // namespace photoslam
