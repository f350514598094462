// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/posed_cameras.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/check.h"
#include "base/file.h"

namespace photoslam {
namespace {

using nlohmann::json;

/// The frame's own value, or the one given for all frames.
const json& value(const json& frame, const json& all, const char* key) {
  return frame.contains(key) ? frame.at(key) : all.at(key);
}

double number(const json& frame, const json& all, const char* key, std::optional<double> otherwise = {}) {
  if (otherwise && !frame.contains(key) && !all.contains(key)) return *otherwise;
  return value(frame, all, key).get<double>();
}

/// Perspective models differ in the coefficients that they have besides k1 to k3; all are used where they are given.
Result<Distortion> read_distortion(const json& frame, const json& all) {
  constexpr std::string_view kPerspective[] = {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "RADIAL", "SIMPLE_RADIAL"};
  const bool is_named = frame.contains("camera_model") || all.contains("camera_model");
  const std::string name = is_named ? value(frame, all, "camera_model").get<std::string>() : "OPENCV";
  const auto coefficient = [&](const char* key) { return number(frame, all, key, 0.0); };
  Distortion d{.k1 = coefficient("k1"), .k2 = coefficient("k2"), .k3 = coefficient("k3")};
  const double k4 = coefficient("k4");
  if (name == "OPENCV_FISHEYE") {
    d.k4 = k4;
    d.model = LensModel::kannala_brandt;
    return d;
  }
  if (std::ranges::find(kPerspective, name) == std::end(kPerspective)) {
    return error("camera_model {}; undistort the images first, or calibrate one of OPENCV and OPENCV_FISHEYE", name);
  }
  if (k4 != 0) return error("k4 is for camera_model OPENCV_FISHEYE, not {}; undistort the images first", name);
  d.p1 = coefficient("p1");
  d.p2 = coefficient("p2");
  return d;
}

Status read_lens(const json& frame, const json& all, PosedCamera& posed) {
  const auto get = [&](const char* key) { return number(frame, all, key); };
  const auto camera = checked_camera(get("w"), get("h"), get("fl_x"), get("fl_y"), get("cx") - 0.5, get("cy") - 0.5);
  if (!camera) return camera.error();
  const auto distortion = read_distortion(frame, all);
  if (!distortion) return distortion.error();
  posed.camera = *camera;
  posed.distortion = *distortion;
  return {};
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

Result<PinholeCamera> checked_camera(double width, double height, double fx, double fy, double cx, double cy) {
  constexpr double kLargest = 65535;
  const auto is_size = [](double v) { return v >= 2 && v <= kLargest && v == std::floor(v); };
  if (!is_size(width) || !is_size(height)) {
    return error("images of {}x{}: sizes must be whole numbers from 2 to {}", width, height, kLargest);
  }
  if (!(fx > 0 && fy > 0) || !std::isfinite(fx) || !std::isfinite(fy)) {
    return error("focal lengths {} and {}: they must be positive", fx, fy);
  }
  if (!std::isfinite(cx) || !std::isfinite(cy)) return error("the principal point is not finite");
  return PinholeCamera{static_cast<int>(width), static_cast<int>(height), fx, fy, cx, cy};
}

Result<std::vector<PosedCamera>> read_transforms_json(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return text.error();
  try {
    const json all = json::parse(*text);
    std::vector<PosedCamera> cameras;
    for (const json& frame : all.at("frames")) {
      PosedCamera& posed = cameras.emplace_back();
      if (Status status = read_lens(frame, all, posed); !status) {
        return error("{}: frame {}: {}", path.string(), cameras.size() - 1, status.error().message);
      }
      posed.camera_from_world = read_pose(frame);
      if (frame.contains("file_path")) posed.image = path.parent_path() / frame.at("file_path").get<std::string>();
    }
    if (cameras.empty()) return error("{}: no frames", path.string());
    return cameras;
  } catch (const json::exception& e) {
    return error("{}: expected a transforms.json: {}", path.string(), e.what());
  }
}

Status write_transforms_json(const std::filesystem::path& path, std::span<const PosedCamera> cameras) {
  nlohmann::ordered_json frames = json::array();
  for (const PosedCamera& posed : cameras) {
    PHOTOSLAM_CHECK(posed.distortion.none(), "{}", posed.image.string());
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
