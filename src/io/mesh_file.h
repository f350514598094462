// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace photoslam {

/// A triangle mesh with the colours it was scanned or painted with.
struct MeshFile {
  using Triangle = std::array<uint32_t, 3>;
  /// Triangles that share an image.
  struct Part {
    std::filesystem::path image;  ///< PNG or JPEG; empty: the vertices carry the colours.
    std::vector<Triangle> triangles;
  };

  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector2f> uvs;  ///< Place in the image, v upwards from its lower edge; zero where there is none.
  std::vector<Eigen::Vector3f> colors;  ///< Display values, 0…1; white where an image has the colour.
  std::vector<Part> parts;

  size_t num_triangles() const;
};

/// Reads a PLY mesh (ASCII or binary little endian; x y z, red green blue, faces with vertex_indices) or an OBJ mesh
/// (v with optional colour, vt, f; images of the map_Kd of its materials, looked up beside the file). Polygons are cut
/// into fans.
///
/// Errors name the file, the line or face, and what is missing: no faces, an index out of range, a position that is
/// not finite, neither vertex colours nor images.
Result<MeshFile> read_mesh(const std::filesystem::path& path);

namespace internal {
Result<MeshFile> parse_ply_mesh(std::string_view content);
/// `folder` holds the materials and images.
Result<MeshFile> parse_obj_mesh(std::string_view content, const std::filesystem::path& folder);
}  // namespace internal

}  // namespace photoslam
