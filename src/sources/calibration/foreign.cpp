// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/calibration/foreign.h"

#include <algorithm>

#include "sources/calibration/coefficients.h"

namespace photoslam::internal {
namespace {

constexpr int kLargestSide = 65536;
constexpr double kLargestFocal = 1e6;

/// Numbers of a list that must be there in full.
std::vector<double> list_of(YamlMap& map, const std::string& key, size_t count) {
  std::vector<double> values = map.numbers(key);
  if (values.size() == count) return values;
  map.fail(key, fmt::format("expected {} numbers of '{}', found {}", count, key, values.size()));
  return std::vector<double>(count, 0.0);
}

Distortion lens(YamlMap& map, const std::string& key, LensModel model, std::span<const double> coefficients) {
  const Result<Distortion> distortion = distortion_from(model, coefficients);
  if (!distortion) map.fail(key, distortion.error().message);
  return distortion ? *distortion : Distortion{};
}

/// Intrinsics of a 3x3 matrix; the size is filled in by the caller.
PinholeCamera from_matrix(YamlMap& map, const std::string& key) {
  const std::vector<double> k = list_of(map, key, 9);
  if (!(k[0] > 0 && k[4] > 0)) map.fail(key, fmt::format("{}: focal lengths must be positive", key));
  return {0, 0, k[0], k[4], k[2], k[5]};
}

/// The image size under the first of the names that is there; 0 where there is none: then the images tell.
int side(YamlMap& map, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (map.has(name)) return map.integer(name, 1, kLargestSide);
  }
  return 0;
}

PinholeCamera orb_slam_camera(YamlMap& map, const std::string& prefix) {
  PinholeCamera camera;
  camera.fx = map.number(prefix + ".fx", 1e-3, kLargestFocal);
  camera.fy = map.number(prefix + ".fy", 1e-3, kLargestFocal);
  camera.cx = map.number(prefix + ".cx", -1e5, 1e5);
  camera.cy = map.number(prefix + ".cy", -1e5, 1e5);
  camera.width = side(map, {"Camera.width", "Camera.imWidth"});
  camera.height = side(map, {"Camera.height", "Camera.imHeight"});
  return camera;
}

Distortion orb_slam_lens(YamlMap& map, const std::string& prefix) {
  const std::string type = map.optional_text("Camera.type").value_or("PinHole");
  if (type == "Rectified") return {};
  const auto coefficient = [&](const char* name) {
    return map.optional_number(prefix + "." + name, -1e3, 1e3).value_or(0);
  };
  if (type == "KannalaBrandt8" || type == "KannalaBrandt") {
    const double c[] = {coefficient("k1"), coefficient("k2"), coefficient("k3"), coefficient("k4")};
    return lens(map, prefix + ".k1", LensModel::kannala_brandt, c);
  }
  if (type != "PinHole") {
    map.fail("Camera.type",
             fmt::format("unknown Camera.type '{}'; there are PinHole, Rectified and KannalaBrandt8", type));
  }
  return {coefficient("k1"), coefficient("k2"), coefficient("p1"), coefficient("p2"),
          coefficient("k3"), coefficient("k4"), coefficient("k5"), coefficient("k6")};
}

SE3 rotation_of(YamlMap& map, const std::string& key) {
  const std::vector<double> r = list_of(map, key, 9);
  const Result<SE3> pose =
      rigid_from_rows(std::vector{r[0], r[1], r[2], 0.0, r[3], r[4], r[5], 0.0, r[6], r[7], r[8], 0.0});
  if (!pose) map.fail(key, fmt::format("{}: {}", key, pose.error().message));
  return pose ? *pose : SE3{};
}

/// The raw cameras behind the rectification matrices of ORB-SLAM2's EuRoC settings.
void read_rectified_pair(YamlMap& map, CameraFile& file) {
  const auto camera = [&](const std::string& name, PinholeCamera& pinhole, Distortion& distortion) {
    const int width = side(map, {(name + ".width").c_str(), "Camera.width"});
    const int height = side(map, {(name + ".height").c_str(), "Camera.height"});
    pinhole = from_matrix(map, name + ".K");
    pinhole.width = width;
    pinhole.height = height;
    distortion = lens(map, name + ".D", LensModel::radial_tangential, map.numbers(name + ".D"));
  };
  RightCamera right;
  camera("LEFT", file.camera, file.distortion);
  camera("RIGHT", right.camera, right.distortion);
  const std::vector<double> p = list_of(map, "RIGHT.P", 12);
  const SE3 shift(Quat::Identity(), Vec3(p[0] > 0 ? p[3] / p[0] : 0, 0, 0));
  right.right_from_left = rotation_of(map, "RIGHT.R").inverse() * shift * rotation_of(map, "LEFT.R");
  file.right = right;
}

void read_second_camera(YamlMap& map, CameraFile& file) {
  if (map.has("Stereo.T_c1_c2")) {
    const Result<SE3> first_from_second = rigid_from_rows(map.numbers("Stereo.T_c1_c2"));
    if (!first_from_second) map.fail("Stereo.T_c1_c2", "Stereo.T_c1_c2: " + first_from_second.error().message);
    if (!first_from_second) return;
    file.right =
        RightCamera{orb_slam_camera(map, "Camera2"), orb_slam_lens(map, "Camera2"), first_from_second->inverse()};
    return;
  }
  std::optional<double> baseline = map.optional_number("Stereo.b", 1e-6, 1e3);
  if (const auto bf = map.optional_number("Camera.bf", 1e-6, 1e6)) baseline = *bf / std::max(file.camera.fx, 1e-3);
  if (baseline) file.right = RightCamera{file.camera, file.distortion, SE3(Quat::Identity(), Vec3(-*baseline, 0, 0))};
}

}  // namespace

bool is_opencv_calibration(const YamlMap& map) { return map.has("camera_matrix"); }

Result<CameraFile> read_opencv_calibration(YamlMap& map) {
  CameraFile file;
  file.camera = from_matrix(map, "camera_matrix");
  file.camera.width = side(map, {"image_width"});
  file.camera.height = side(map, {"image_height"});
  const std::string model = map.optional_text("distortion_model").value_or("plumb_bob");
  const bool fisheye = model == "equidistant" || model == "fisheye";
  const std::string key = map.has("distortion_coefficients") ? "distortion_coefficients" : "dist_coeffs";
  file.distortion =
      lens(map, key, fisheye ? LensModel::kannala_brandt : LensModel::radial_tangential, map.numbers(key));
  if (const Status status = map.status(); !status) return status.error();
  return file;
}

bool is_orb_slam_settings(const YamlMap& map) {
  return map.has("Camera.fx") || map.has("Camera1.fx") || map.has("LEFT.K");
}

Result<CameraFile> read_orb_slam_settings(YamlMap& map) {
  CameraFile file;
  if (map.has("LEFT.K")) {
    read_rectified_pair(map, file);
  } else {
    const std::string prefix = map.has("Camera1.fx") ? "Camera1" : "Camera";
    file.camera = orb_slam_camera(map, prefix);
    file.distortion = orb_slam_lens(map, prefix);
    read_second_camera(map, file);
  }
  file.frames_per_second = map.optional_number("Camera.fps", 1e-3, 1e5);
  for (const char* key : {"DepthMapFactor", "RGBD.DepthMapFactor"}) {
    if (map.has(key)) file.depth_scale = map.number(key, 1e-6, 1e9);
  }
  if (const Status status = map.status(); !status) return status.error();
  return file;
}

}  // namespace photoslam::internal
