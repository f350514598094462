// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photoslam/splat_map.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "api/splat_map_state.h"
#include "base/executor.h"
#include "evaluation/map_scoring.h"
#include "image/convert.h"
#include "photorealistic_mapping/view_geometry.h"
#include "photorealistic_mapping/world_export.h"
#include "splatting/renderer.h"

namespace photoslam {

SplatMap SplatMapAccess::make(GaussianTable table) {
  SplatMap map;
  splatting::GaussianModel model = from_world(table);
  map.state_ = std::make_shared<const SplatMap::State>(SplatMap::State{std::move(table), std::move(model)});
  return map;
}

SplatMap::SplatMap() : state_(std::make_shared<const State>()) {}

SplatMap SplatMap::load(const std::filesystem::path& file) {
  Result<GaussianTable> table = read_gaussian_ply(file);
  if (!table) throw Failure(table.error().message);
  return SplatMapAccess::make(std::move(*table));
}

void SplatMap::save(const std::filesystem::path& file) const {
  if (const auto written = write_gaussian_ply(file, state_->table); !written) throw Failure(written.error().message);
}

size_t SplatMap::num_gaussians() const { return state_->table.size(); }

std::vector<uint8_t> SplatMap::render(const CameraModel& camera, const CameraPose& pose) const {
  if (camera.width <= 0 || camera.height <= 0 || camera.fx <= 0 || camera.fy <= 0)
    throw Failure("render: the camera needs a size and focal lengths");
  const PinholeCamera pinhole{camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
  const auto& [w, x, y, z] = pose.orientation;
  const SE3 world_from_camera(Quat(w, x, y, z).normalized(),
                              Vec3(pose.position[0], pose.position[1], pose.position[2]));
  const std::vector<SE3> world = {SE3{}};
  std::vector<splatting::Pose> camera_from_anchor;
  camera_from_anchors(world_from_camera.inverse(), world, camera_from_anchor);
  ThreadPool executor(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  splatting::Renderer renderer;
  splatting::RenderResult result;
  renderer.render(state_->model, {to_splatting(pinhole), camera_from_anchor}, {}, executor, result);
  const ImageU8 image = to_u8(to_image(result));
  return {image.values().begin(), image.values().end()};
}

}  // namespace photoslam
