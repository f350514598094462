// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/mesh_world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/image_file.h"
#include "io/mesh_file.h"
#include "io/trajectory_file.h"
#include "sources/synthetic/furniture/workshop.h"

namespace photoslam {
namespace {

using synthetic::SceneModel;
using synthetic::Vec2f;
using synthetic::Vec3f;

class FilmedMesh final : public SyntheticWorld {
 public:
  FilmedMesh(SceneModel model, Trajectory poses, Executor& executor)
      : SyntheticWorld(std::move(model), SceneQuality::full, executor), poses_(std::move(poses)) {}

  std::unique_ptr<const CameraPath> path(uint64_t, double) const override {
    return std::make_unique<RecordedPath>(poses_);
  }

 private:
  Trajectory poses_;
};

/// Image widths per metre on the surface: square root of the ratio of areas.
float texture_density(const MeshFile& mesh, const MeshFile::Part& part) {
  double on_surface = 0, in_image = 0;
  for (const auto& [a, b, c] : part.triangles) {
    on_surface += (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).norm();
    const Vec2f u = mesh.uvs[b] - mesh.uvs[a], v = mesh.uvs[c] - mesh.uvs[a];
    in_image += std::abs(u.x() * v.y() - u.y() * v.x());
  }
  return on_surface > 0 ? static_cast<float>(std::sqrt(in_image / on_surface)) : 0.0f;
}

/// Texture places are in image widths, with v downwards.
void add_part(const MeshFile& file, const MeshFile::Part& part, const ImageU8& image, Executor& executor,
              SceneModel& model) {
  const auto aspect = static_cast<float>(image.height()) / static_cast<float>(image.width());
  synthetic::Patch patch;
  patch.material = static_cast<int>(model.mesh.materials.size());
  patch.texture_origin = Vec2f(0, aspect);
  patch.texture_size = Vec2f(1, -aspect);
  patch.texture_metres = texture_density(file, part);
  patch.light_width = patch.light_height = 0;
  const auto index = static_cast<uint32_t>(model.mesh.patches.size());
  model.mesh.materials.push_back({.texture = static_cast<int>(model.textures.size()), .gloss = 0});
  model.textures.push_back(synthetic::Texture::from_image(image, executor));
  model.mesh.patches.push_back(patch);
  for (const auto& triangle : part.triangles) model.mesh.triangles.push_back({triangle, index});
}

Result<SceneModel> scene_of(const MeshFile& file, Executor& executor) {
  SceneModel model;
  model.baked = true;
  model.lights.sky = [](const Vec3f&) { return synthetic::Color(0, 0, 0, 0); };
  for (size_t i = 0; i < file.positions.size(); ++i) {
    model.mesh.vertices.push_back({file.positions[i], Vec3f::UnitZ(), file.uvs[i]});
    const Vec3f linear = file.colors[i].cwiseMax(0.0f).cwiseMin(1.0f).cwiseAbs2();
    model.mesh.tints.push_back({linear.x(), linear.y(), linear.z(), 1});
  }
  for (const MeshFile::Part& part : file.parts) {
    const Result<ImageU8> image = part.image.empty() ? ImageU8(1, 1, 3, 255) : read_image(part.image);
    if (!image) return image.error();
    add_part(file, part, *image, executor, model);
  }
  return model;
}

}  // namespace

Result<MeshWorld> open_mesh_world(const std::filesystem::path& mesh, const std::filesystem::path& trajectory,
                                  Executor& executor) {
  Result<Trajectory> poses = read_walk(trajectory);
  if (!poses) return poses.error();
  const Result<MeshFile> file = read_mesh(mesh);
  if (!file) return file.error();
  Result<SceneModel> model = scene_of(*file, executor);
  if (!model) return model.error();
  const double seconds = RecordedPath(*poses).seconds();
  return MeshWorld{std::make_shared<const FilmedMesh>(std::move(*model), std::move(*poses), executor), seconds};
}

}  // namespace photoslam
