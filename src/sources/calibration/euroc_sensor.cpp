// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/calibration/euroc_sensor.h"

#include <algorithm>
#include <array>

#include "sources/calibration/coefficients.h"
#include "sources/calibration/yaml_map.h"

namespace photoslam {
namespace {

using internal::YamlMap;

constexpr const char* kPoseKey = "T_BS";

SE3 read_pose(YamlMap& map) {
  if (!map.has(kPoseKey)) return {};
  const Result<SE3> pose = rigid_from_rows(map.numbers(kPoseKey));
  if (!pose) map.fail(kPoseKey, fmt::format("{}: {}", kPoseKey, pose.error().message));
  return pose ? *pose : SE3{};
}

/// Numbers of a list that must be there in full.
std::vector<double> list_of(YamlMap& map, const std::string& key, size_t count, const char* layout) {
  std::vector<double> values = map.numbers(key);
  if (values.size() == count) return values;
  map.fail(key, fmt::format("expected '{}: {}'", key, layout));
  return std::vector<double>(count, 0.0);
}

Distortion read_distortion(YamlMap& map) {
  constexpr const char* kModel = "distortion_model";
  constexpr const char* kCoefficients = "distortion_coefficients";
  const std::string name = map.optional_text(kModel).value_or("radial-tangential");
  const auto is = [&name](const auto& names) { return std::ranges::find(names, name) != names.end(); };
  constexpr std::array<std::string_view, 5> kRadial = {"radial-tangential", "radtan", "plumb_bob", "none",
                                                       "rational_polynomial"};
  constexpr std::array<std::string_view, 4> kFisheye = {"equidistant", "fisheye", "kannala_brandt", "equi"};
  if (!is(kRadial) && !is(kFisheye)) {
    map.fail(kModel, fmt::format("unknown distortion_model '{}'; known are radial-tangential and equidistant", name));
  }
  const auto distortion = distortion_from(is(kFisheye) ? LensModel::kannala_brandt : LensModel::radial_tangential,
                                          map.numbers(kCoefficients));
  if (!distortion) map.fail(kCoefficients, distortion.error().message);
  return distortion ? *distortion : Distortion{};
}

}  // namespace

Result<EurocSensor> read_euroc_sensor(const std::filesystem::path& path) {
  Result<YamlMap> loaded = YamlMap::load(path);
  if (!loaded) return loaded.error();
  YamlMap& map = *loaded;
  if (map.optional_text("camera_model").value_or("pinhole") != "pinhole") {
    map.fail("camera_model", "the only known camera_model is 'pinhole'");
  }
  const std::vector<double> size = list_of(map, "resolution", 2, "[width, height]");
  const std::vector<double> k = list_of(map, "intrinsics", 4, "[fu, fv, cu, cv]");
  constexpr double kLargestSide = 65536;
  if (!std::ranges::all_of(size, [](double side) { return side >= 1 && side <= kLargestSide; })) {
    map.fail("resolution", "the resolution makes no sense");
  }
  if (!(k[0] > 0 && k[1] > 0)) map.fail("intrinsics", "focal lengths must be positive");

  EurocSensor sensor;
  sensor.file.camera = {static_cast<int>(size[0]), static_cast<int>(size[1]), k[0], k[1], k[2], k[3]};
  sensor.file.distortion = read_distortion(map);
  sensor.file.frames_per_second = map.optional_number("rate_hz", 1e-3, 1e5);
  sensor.body_from_camera = read_pose(map);
  if (const Status status = map.status(); !status) return status.error();
  return sensor;
}

Result<SE3> read_body_from_sensor(const std::filesystem::path& path) {
  Result<YamlMap> map = YamlMap::load(path);
  if (!map) return map.error();
  const SE3 pose = read_pose(*map);
  if (const Status status = map->status(); !status) return status.error();
  return pose;
}

}  // namespace photoslam
