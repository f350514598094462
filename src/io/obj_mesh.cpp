// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <utility>

#include "base/file.h"
#include "io/mesh_file.h"
#include "io/text_table.h"

namespace photoslam::internal {
namespace {

namespace fs = std::filesystem;
using Fields = std::vector<std::string_view>;

/// The rest of a line after its keyword: names may contain blanks.
std::string rest_of(const Fields& fields) {
  if (fields.size() < 2) return {};
  return {fields[1].data(), fields.back().data() + fields.back().size()};
}

fs::path local_path(const fs::path& folder, std::string name) {
  for (char& c : name) c = c == '\\' ? '/' : c;  // files made on Windows
  return folder / name;
}

/// Statements of an OBJ file, one after another. A vertex of the mesh is a pair of a position and an image place.
class ObjParser {
 public:
  explicit ObjParser(fs::path folder) : folder_(std::move(folder)) {}

  Status accept(const Fields& fields) {
    const std::string_view keyword = fields[0];
    if (keyword == "v") return accept_position(fields);
    if (keyword == "vt") return accept_place(fields);
    if (keyword == "f") return accept_face(fields);
    if (keyword == "mtllib") return read_materials(local_path(folder_, rest_of(fields)));
    if (keyword == "usemtl") image_ = images_.contains(rest_of(fields)) ? images_.at(rest_of(fields)) : fs::path();
    return {};  // normals, groups, smoothing and lines show nothing
  }

  MeshFile finish() && {
    for (auto& [image, triangles] : parts_) mesh_.parts.push_back({image, std::move(triangles)});
    return std::move(mesh_);
  }

 private:
  Status numbers(const Fields& fields, std::span<float> out) const {
    if (fields.size() < out.size() + 1) return error("expected {} numbers after '{}'", out.size(), fields[0]);
    for (size_t i = 0; i < out.size(); ++i) {
      const Result<double> value = parse_number(fields[i + 1]);
      if (!value) return value.error();
      out[i] = static_cast<float>(*value);
    }
    return {};
  }

  Status accept_position(const Fields& fields) {
    std::array<float, 6> v{0, 0, 0, 1, 1, 1};
    has_color_.push_back(fields.size() >= 7);
    if (Status status = numbers(fields, std::span(v).first(has_color_.back() ? 6 : 3)); !status) return status;
    positions_.emplace_back(v[0], v[1], v[2]);
    colors_.emplace_back(v[3], v[4], v[5]);
    return {};
  }

  Status accept_place(const Fields& fields) {
    std::array<float, 2> v{};
    if (Status status = numbers(fields, v); !status) return status;
    places_.emplace_back(v[0], v[1]);
    return {};
  }

  /// Reads "a", "a/b", "a//c" or "a/b/c"; indices start at 1, and at -1 from the end.
  Result<uint32_t> vertex(std::string_view text) {
    const auto index = [](std::string_view part, size_t count) -> Result<size_t> {
      long value = 0;
      const auto [end, code] = std::from_chars(part.data(), part.data() + part.size(), value);
      const long number = value < 0 ? static_cast<long>(count) + value : value - 1;
      if (code != std::errc() || end != part.data() + part.size() || number < 0 || number >= static_cast<long>(count))
        return error("'{}' is none of the {} before it", part.substr(0, 40), count);
      return static_cast<size_t>(number);
    };
    const size_t slash = text.find('/');
    const Result<size_t> position = index(text.substr(0, slash), positions_.size());
    if (!position) return error("a face: vertex {}", position.error().message);
    std::string_view place_text = slash == std::string_view::npos ? "" : text.substr(slash + 1);
    place_text = place_text.substr(0, place_text.find('/'));
    size_t place = kNoPlace;
    if (!place_text.empty()) {
      const Result<size_t> given = index(place_text, places_.size());
      if (!given) return error("a face: image place {}", given.error().message);
      place = *given;
    }
    const bool painted = !image_.empty() && place != kNoPlace;
    if (!painted && !has_color_[*position]) {
      return error("a face has neither colours at its vertices (v x y z r g b) nor an image (vt and map_Kd)");
    }
    const auto [entry, is_new] = vertices_.try_emplace({*position, place, painted}, mesh_.positions.size());
    if (is_new) {
      mesh_.positions.push_back(positions_[*position]);
      mesh_.uvs.push_back(place == kNoPlace ? Eigen::Vector2f(0, 0) : places_[place]);
      mesh_.colors.push_back(painted ? Eigen::Vector3f(1, 1, 1) : colors_[*position]);
    }
    return entry->second;
  }

  Status accept_face(const Fields& fields) {
    std::vector<uint32_t> corners;
    for (size_t i = 1; i < fields.size(); ++i) {
      const Result<uint32_t> corner = vertex(fields[i]);
      if (!corner) return corner.error();
      corners.push_back(*corner);
    }
    if (corners.size() < 3) return error("a face needs at least 3 vertices");
    for (size_t i = 2; i < corners.size(); ++i) parts_[image_].push_back({corners[0], corners[i - 1], corners[i]});
    return {};
  }

  Status read_materials(const fs::path& path) {
    const Result<std::string> content = read_file(path);
    if (!content) return content.error();
    std::string name;
    for (const TextLine& line : split_table(*content)) {
      if (line.fields[0] == "newmtl") name = rest_of(line.fields);
      if (line.fields[0] == "map_Kd") images_[name] = local_path(folder_, rest_of(line.fields));
    }
    return {};
  }

  static constexpr size_t kNoPlace = static_cast<size_t>(-1);
  fs::path folder_, image_;
  std::vector<Eigen::Vector3f> positions_, colors_;
  std::vector<bool> has_color_;
  std::vector<Eigen::Vector2f> places_;
  std::map<std::string, fs::path> images_;                         // by material
  std::map<std::tuple<size_t, size_t, bool>, uint32_t> vertices_;  // (position, place, painted)
  std::map<fs::path, std::vector<MeshFile::Triangle>> parts_;      // by image
  MeshFile mesh_;
};

}  // namespace

Result<MeshFile> parse_obj_mesh(std::string_view content, const fs::path& folder) {
  ObjParser parser(folder);
  for (const TextLine& line : split_table(content)) {
    if (Status status = parser.accept(line.fields); !status) {
      return error("line {}: {}", line.number, status.error().message);
    }
  }
  return std::move(parser).finish();
}

}  // namespace photoslam::internal
