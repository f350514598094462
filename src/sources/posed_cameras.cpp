// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/posed_cameras.h"

#include <nlohmann/json.hpp>

#include "base/file.h"

namespace photoslam {
namespace {

using nlohmann::json;

/// The frame's own value, or the one given for all frames.
double number(const json& frame, const json& all, const char* key) {
  return frame.contains(key) ? frame.at(key).get<double>() : all.at(key).get<double>();
}

PinholeCamera read_intrinsics(const json& frame, const json& all) {
  PinholeCamera camera;
  camera.width = static_cast<int>(number(frame, all, "w"));
  camera.height = static_cast<int>(number(frame, all, "h"));
  camera.fx = number(frame, all, "fl_x");
  camera.fy = number(frame, all, "fl_y");
  camera.cx = number(frame, all, "cx") - 0.5;
  camera.cy = number(frame, all, "cy") - 0.5;
  return camera;
}

SE3 read_pose(const json& frame) {
  Eigen::Matrix4d world_from_camera;
  const json& rows = frame.at("transform_matrix");
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      world_from_camera(r, c) = rows.at(static_cast<size_t>(r)).at(static_cast<size_t>(c)).get<double>();
    }
  }
  world_from_camera.col(1) *= -1;  // y up → y down
  world_from_camera.col(2) *= -1;  // z backwards → z forward
  return SE3::from_matrix(world_from_camera).inverse();
}

}  // namespace

Result<std::vector<PosedCamera>> read_transforms_json(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return text.error();
  try {
    const json all = json::parse(*text);
    for (const char* key : {"k1", "k2", "k3", "k4", "p1", "p2"}) {
      if (all.contains(key) && all.at(key).get<double>() != 0) {
        return error("{}: {} is not zero; undistort the images first", path.string(), key);
      }
    }
    std::vector<PosedCamera> cameras;
    for (const json& frame : all.at("frames")) {
      PosedCamera& posed = cameras.emplace_back();
      posed.camera = read_intrinsics(frame, all);
      posed.camera_from_world = read_pose(frame);
      if (frame.contains("file_path")) posed.image = path.parent_path() / frame.at("file_path").get<std::string>();
      const PinholeCamera& c = posed.camera;
      if (c.width <= 0 || c.height <= 0 || !(c.fx > 0) || !(c.fy > 0)) {
        return error("{}: frame {}: width, height and focal lengths must be positive", path.string(),
                     cameras.size() - 1);
      }
    }
    if (cameras.empty()) return error("{}: no frames", path.string());
    return cameras;
  } catch (const json::exception& e) {
    return error("{}: {}", path.string(), e.what());
  }
}

Status write_transforms_json(const std::filesystem::path& path, std::span<const PosedCamera> cameras) {
  nlohmann::ordered_json frames = json::array();
  for (const PosedCamera& posed : cameras) {
    Eigen::Matrix4d world_from_camera = posed.camera_from_world.inverse().matrix();
    world_from_camera.col(1) *= -1;
    world_from_camera.col(2) *= -1;
    nlohmann::ordered_json rows = json::array();
    for (int r = 0; r < 4; ++r) {
      rows.push_back(
          {world_from_camera(r, 0), world_from_camera(r, 1), world_from_camera(r, 2), world_from_camera(r, 3)});
    }
    const PinholeCamera& c = posed.camera;
    frames.push_back({{"file_path", posed.image.lexically_relative(path.parent_path()).generic_string()},
                      {"w", c.width},
                      {"h", c.height},
                      {"fl_x", c.fx},
                      {"fl_y", c.fy},
                      {"cx", c.cx + 0.5},
                      {"cy", c.cy + 0.5},
                      {"transform_matrix", rows}});
  }
  const nlohmann::ordered_json all = {{"camera_model", "OPENCV"}, {"frames", frames}};
  return write_file_atomically(path, all.dump(1) + "\n");
}

}  // namespace photoslam
