// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/camera_file.h"

#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/nearest_name.h"

namespace photoslam {
namespace {

/// Reads values of a YAML map and remembers the first thing that is wrong.
class CameraFileReader {
 public:
  CameraFileReader(const YAML::Node& root, std::string path) : root_(root), path_(std::move(path)) {}

  Result<CameraFile> read() {
    CameraFile file;
    check_keys();
    check_model();
    file.camera.width = static_cast<int>(required("width", 1, 65536));
    file.camera.height = static_cast<int>(required("height", 1, 65536));
    file.camera.fx = required("fx", 1e-3, 1e6);
    file.camera.fy = required("fy", 1e-3, 1e6);
    file.camera.cx = required("cx", -1e5, 1e5);
    file.camera.cy = required("cy", -1e5, 1e5);
    file.distortion = read_distortion();
    file.frames_per_second = optional("fps", 1e-3, 1e5);
    file.depth_scale = optional("depth_scale", 1e-6, 1e9);
    if (!failure_.empty()) return Error{failure_};
    return file;
  }

 private:
  void fail(const YAML::Node& node, const std::string& what) {
    if (failure_.empty()) failure_ = fmt::format("{}:{}: {}", path_, node.Mark().line + 1, what);
  }

  void check_keys() {
    static const std::array<std::string, 10> kKeys = {"model", "width", "height",     "fx",  "fy",
                                                      "cx",    "cy",    "distortion", "fps", "depth_scale"};
    for (const auto& entry : root_) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
      if (std::ranges::find(kKeys, key) != kKeys.end()) continue;
      const std::string nearest = nearest_name(key, kKeys);
      fail(entry.first, nearest.empty() ? fmt::format("unknown key '{}'", key)
                                        : fmt::format("unknown key '{}'; did you mean '{}'?", key, nearest));
    }
  }

  void check_model() {
    const YAML::Node model = root_["model"];
    if (model && !(model.IsScalar() && model.Scalar() == "pinhole")) fail(model, "the only known model is 'pinhole'");
  }

  double number(const YAML::Node& node, const std::string& name, double min, double max) {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      fail(node, fmt::format("{} is not a number", name));
    } else if (value < min || value > max) {
      fail(node, fmt::format("{} = {} lies outside [{}, {}]", name, value, min, max));
    }
    return value;
  }

  std::optional<double> optional(const char* key, double min, double max) {
    const YAML::Node node = root_[key];
    if (!node || node.IsNull()) return std::nullopt;
    return number(node, key, min, max);
  }

  double required(const char* key, double min, double max) {
    const std::optional<double> value = optional(key, min, max);
    if (!value && failure_.empty()) failure_ = fmt::format("{}: the key '{}' is missing", path_, key);
    return value.value_or(0);
  }

  Distortion read_distortion() {
    const YAML::Node node = root_["distortion"];
    if (!node || node.IsNull()) return {};
    if (!node.IsSequence() || (node.size() != 0 && node.size() != 4 && node.size() != 5)) {
      fail(node, "distortion must be a list of 4 or 5 coefficients [k1, k2, p1, p2, k3], or empty");
      return {};
    }
    std::array<double, 5> values{};
    for (size_t i = 0; i < node.size(); ++i) values[i] = number(node[i], "a distortion coefficient", -1e3, 1e3);
    return {values[0], values[1], values[2], values[3], values[4]};
  }

  const YAML::Node root_;
  const std::string path_;
  std::string failure_;
};

}  // namespace

Result<CameraFile> read_camera_yaml(const std::filesystem::path& path) {
  const Result<std::string> content = read_file(path);
  if (!content) return content.error();
  try {
    const YAML::Node root = YAML::Load(*content);
    if (!root.IsMap()) return error("{}: expected lines like 'fx: 525.0'", path.string());
    return CameraFileReader(root, path.string()).read();
  } catch (const YAML::Exception& exception) {
    return error("{}:{}: {}", path.string(), exception.mark.line + 1, exception.msg);
  }
}

}  // namespace photoslam
