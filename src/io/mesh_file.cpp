// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/mesh_file.h"

#include <algorithm>
#include <numeric>

#include "base/file.h"

namespace photoslam {
namespace {

Status check(const MeshFile& mesh) {
  if (mesh.num_triangles() == 0) return error("has no faces; a point cloud cannot be filmed");
  for (const MeshFile::Part& part : mesh.parts) {
    for (const MeshFile::Triangle& triangle : part.triangles) {
      for (const uint32_t vertex : triangle) {
        if (vertex >= mesh.positions.size())
          return error("a face names vertex {}, but there are {}", vertex, mesh.positions.size());
      }
    }
  }
  const auto bad = std::ranges::find_if(mesh.positions, [](const Eigen::Vector3f& p) { return !p.allFinite(); });
  if (bad != mesh.positions.end()) return error("vertex {} is not finite", bad - mesh.positions.begin());
  return {};
}

}  // namespace

size_t MeshFile::num_triangles() const {
  return std::accumulate(parts.begin(), parts.end(), size_t{0},
                         [](size_t sum, const Part& part) { return sum + part.triangles.size(); });
}

Result<MeshFile> read_mesh(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  Result<MeshFile> mesh = content->starts_with("ply") ? internal::parse_ply_mesh(*content)
                                                      : internal::parse_obj_mesh(*content, path.parent_path());
  if (!mesh) return error("{}: {}", path.string(), mesh.error().message);
  if (Status status = check(*mesh); !status) return error("{}: {}", path.string(), status.error().message);
  return mesh;
}

}  // namespace photoslam
