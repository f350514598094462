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

/// The kind of lens that a file of OpenCV or ROS states; nothing where it does not.
std::optional<LensModel> stated_lens(YamlMap& map) {
  if (const auto fisheye = map.optional_text("fisheye_model")) {  // of OpenCV's calibration sample
    return *fisheye == "0" || *fisheye == "false" ? LensModel::radial_tangential : LensModel::kannala_brandt;
  }
  const auto model = map.optional_text("distortion_model");
  if (!model) return std::nullopt;
  for (const char* name : {"plumb_bob", "rational_polynomial", "radtan", "radial-tangential"}) {
    if (*model == name) return LensModel::radial_tangential;
  }
  for (const char* name : {"equidistant", "fisheye", "kannala_brandt"}) {
    if (*model == name) return LensModel::kannala_brandt;
  }
  map.fail(
      "distortion_model",
      fmt::format("unknown distortion_model '{}'; there are plumb_bob, rational_polynomial and equidistant", *model));
  return std::nullopt;
}

/// Coefficients as OpenCV's calibrateCamera or its fisheye module give them. Four numbers may be of either.
Distortion opencv_lens(YamlMap& map, const std::string& key) {
  const std::optional<LensModel> stated = stated_lens(map);
  const std::vector<double> coefficients = map.numbers(key);
  const bool some = std::ranges::any_of(coefficients, [](double c) { return c != 0; });
  if (!stated && coefficients.size() == 4 && some) {
    map.fail(key, fmt::format("{}: four numbers may be k1 k2 p1 p2 or the k1 k2 k3 k4 of cv::fisheye; add the line "
                              "'distortion_model: plumb_bob' or 'distortion_model: equidistant'",
                              key));
  }
  return lens(map, key, stated.value_or(LensModel::radial_tangential), coefficients);
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
  file.distortion = opencv_lens(map, map.has("distortion_coefficients") ? "distortion_coefficients" : "dist_coeffs");
  if (const Status status = map.status(); !status) return status.error();
  return file;
}

bool is_opencv_stereo(const YamlMap& map) { return map.has("M1") && map.has("M2"); }

Result<CameraFile> read_opencv_stereo(YamlMap& map) {
  constexpr double kLongestBaseline = 10;  // m
  CameraFile file;
  RightCamera right;
  file.camera = from_matrix(map, "M1");
  right.camera = from_matrix(map, "M2");
  file.camera.width = right.camera.width = side(map, {"image_width"});
  file.camera.height = right.camera.height = side(map, {"image_height"});
  file.distortion = opencv_lens(map, "D1");
  right.distortion = opencv_lens(map, "D2");
  if (!map.has("R") || !map.has("T")) {
    map.fail(
        "M2",
        "the pair's R and T are missing; OpenCV's sample writes them to extrinsics.yml: append its lines from R on");
  }
  const std::vector<double> t = list_of(map, "T", 3);
  const double baseline = Vec3(t[0], t[1], t[2]).norm();
  if (!(baseline > 0 && baseline < kLongestBaseline)) {
    map.fail("T",
             fmt::format("T: the cameras are {:g} m apart; T must be in metres, and OpenCV has it in the unit that "
                         "the squares of the calibration board were given in",
                         baseline));
  }
  right.right_from_left = SE3(Quat::Identity(), Vec3(t[0], t[1], t[2])) * rotation_of(map, "R");
  file.right = right;
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
