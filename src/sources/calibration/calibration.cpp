// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/calibration/calibration.h"

#include <cmath>
#include <numbers>

#include "base/file.h"
#include "sources/calibration/euroc_sensor.h"
#include "sources/calibration/foreign.h"
#include "sources/calibration/kitti_calib.h"
#include "sources/calibration/yaml_map.h"

namespace photoslam {
namespace {

Result<CameraFile> read_kitti_pair(const std::filesystem::path& path) {
  const auto cameras = read_kitti_calib(path);
  if (!cameras) return cameras.error();
  const auto& [number, left] = *cameras->begin();
  CameraFile file;
  file.camera = {0, 0, left.fx, left.fy, left.cx, left.cy};
  if (const auto found = cameras->find(number + 1); found != cameras->end()) {
    const KittiCamera& right = found->second;
    file.right = RightCamera{{0, 0, right.fx, right.fy, right.cx, right.cy},
                             {},
                             SE3(Quat::Identity(), right.camera_from_cam0 - left.camera_from_cam0)};
  }
  return file;
}

bool looks_like_kitti_calib(const std::string& content) {
  for (const char* label : {"P0:", "P1:", "P2:", "P3:", "P_rect_0"}) {
    if (content.starts_with(label) || content.find(fmt::format("\n{}", label)) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

Result<CameraFile> read_calibration(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  if (looks_like_kitti_calib(*content)) return read_kitti_pair(path);
  auto map = internal::YamlMap::load(path);
  if (!map) return map.error();
  if (internal::is_orb_slam_settings(*map)) return internal::read_orb_slam_settings(*map);
  if (internal::is_opencv_calibration(*map)) return internal::read_opencv_calibration(*map);
  if (internal::is_opencv_stereo(*map)) return internal::read_opencv_stereo(*map);
  if (map->has("intrinsics")) {
    Result<EurocSensor> sensor = read_euroc_sensor(path);
    if (!sensor) return sensor.error();
    return std::move(sensor->file);
  }
  return read_camera_yaml(path);
}

CameraFile guess_camera(double fov_deg, int width, int height) {
  const double focal = 0.5 * width / std::tan(0.5 * fov_deg * std::numbers::pi / 180);
  CameraFile file;
  file.camera = {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)};
  file.is_guess = true;
  return file;
}

namespace internal {

Result<std::optional<CameraFile>> chosen_camera(const std::filesystem::path& path, double fov_deg, int width,
                                                int height, std::vector<std::string>& notes) {
  if (path.empty() && fov_deg <= 0) return std::optional<CameraFile>();
  if (path.empty()) {
    CameraFile file = guess_camera(fov_deg, width, height);
    notes.push_back(
        fmt::format("no calibration: a rough guess from --fov {:g}, f = {:.1f} px without distortion; "
                    "expect bent walls and a wrong scale",
                    fov_deg, file.camera.fx));
    return std::optional(std::move(file));
  }
  Result<CameraFile> file = read_calibration(path);
  if (!file) return file.error();
  const auto settle = [&](PinholeCamera& camera) {
    if (camera.width == 0) camera.width = width;
    if (camera.height == 0) camera.height = height;
  };
  settle(file->camera);
  if (file->right) settle(file->right->camera);
  return std::optional(std::move(*file));
}

Status apply_camera(const CameraFile& file, const std::string& where, SourceInfo& info) {
  if (info.sensor == SensorKind::stereo && !file.right) {
    return error("{} describes one camera, and {} is stereo; name a calibration of both, or add --sensor mono", where,
                 info.name);
  }
  info.camera = file.camera;
  info.distortion = file.distortion;
  info.camera_is_guess = file.is_guess;
  info.frames_per_second = file.frames_per_second.value_or(0);
  if (info.sensor == SensorKind::stereo) info.right = file.right;
  return {};
}

}  // namespace internal
}  // namespace photoslam
