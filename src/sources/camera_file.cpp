// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/camera_file.h"

#include <array>
#include <cmath>
#include <string>

#include "sources/calibration/coefficients.h"
#include "sources/calibration/yaml_map.h"

namespace photoslam {
namespace {

using internal::YamlMap;

Distortion read_distortion(YamlMap& map) {
  LensModel model = LensModel::radial_tangential;
  if (const auto name = map.optional_text("model"); name == "fisheye") {
    model = LensModel::kannala_brandt;
  } else if (name && name != "pinhole") {
    map.fail("model", fmt::format("unknown model '{}'; there are pinhole and fisheye", *name));
  }
  const Result<Distortion> distortion = distortion_from(model, map.numbers("distortion"));
  if (!distortion) map.fail("distortion", distortion.error().message);
  return distortion ? *distortion : Distortion{};
}

}  // namespace

Result<CameraFile> read_camera_yaml(const std::filesystem::path& path) {
  Result<YamlMap> loaded = YamlMap::load(path);
  if (!loaded) return loaded.error();
  YamlMap& map = *loaded;
  static const std::array<std::string, 10> kKeys = {"model", "width", "height",     "fx",  "fy",
                                                    "cx",    "cy",    "distortion", "fps", "depth_scale"};
  map.allow_only(kKeys);
  constexpr int kLargestSide = 65536;
  CameraFile file;
  file.camera.width = map.integer("width", 1, kLargestSide);
  file.camera.height = map.integer("height", 1, kLargestSide);
  file.camera.fx = map.number("fx", 1e-3, 1e6);
  file.camera.fy = map.number("fy", 1e-3, 1e6);
  file.camera.cx = map.number("cx", -1e5, 1e5);
  file.camera.cy = map.number("cy", -1e5, 1e5);
  file.distortion = read_distortion(map);
  file.frames_per_second = map.optional_number("fps", 1e-3, 1e5);
  file.depth_scale = map.optional_number("depth_scale", 1e-6, 1e9);
  if (const Status status = map.status(); !status) return status.error();
  const PinholeCamera& c = file.camera;
  if (std::abs(c.cx - 0.5 * c.width) > c.width || std::abs(c.cy - 0.5 * c.height) > c.height) {
    return error("{}: cx {}, cy {} lie far outside of an image of {}x{}", path.string(), c.cx, c.cy, c.width, c.height);
  }
  return file;
}

std::string camera_yaml(const CameraFile& file) {
  const PinholeCamera& c = file.camera;
  const bool fisheye = file.distortion.model == LensModel::kannala_brandt;
  std::string text = fmt::format(
      "# colour camera{}\nmodel: {}\nwidth: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\ndistortion: [{}]\n",
      file.depth_scale ? "; depth is registered to it" : "", fisheye ? "fisheye" : "pinhole", c.width, c.height, c.fx,
      c.fy, c.cx, c.cy, coefficients_text(file.distortion));
  if (file.frames_per_second) text += fmt::format("fps: {}\n", *file.frames_per_second);
  if (file.depth_scale) {
    text += fmt::format("depth_scale: {:.12g}  # stored value / depth_scale = metres\n", *file.depth_scale);
  }
  return text;
}

}  // namespace photoslam
