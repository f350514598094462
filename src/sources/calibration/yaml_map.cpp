// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/calibration/yaml_map.h"

#include <algorithm>
#include <cmath>

#include "base/file.h"
#include "base/nearest_name.h"

namespace photoslam::internal {

Result<YamlMap> YamlMap::load(const std::filesystem::path& path) {
  Result<std::string> content = read_file(path);
  if (!content) return content.error();
  if (content->starts_with("%YAML:")) content->front() = '#';  // OpenCV's directive is not YAML
  try {
    YAML::Node root = YAML::Load(*content);
    if (!root.IsMap()) return error("{}: expected lines like 'fx: 525.0'", path.string());
    return YamlMap(std::move(root), path.string());
  } catch (const YAML::Exception& exception) {
    return error("{}:{}: {}", path.string(), exception.mark.line + 1, exception.msg);
  }
}

YAML::Node YamlMap::find(const std::string& key) const {
  const YAML::Node& constant = root_;  // a mutable node would add the key
  const YAML::Node node = constant[key];
  return node && !node.IsNull() ? node : YAML::Node(YAML::NodeType::Undefined);
}

bool YamlMap::has(const std::string& key) const { return find(key).IsDefined(); }

void YamlMap::fail(const YAML::Node& node, const std::string& what) {
  if (failure_.empty()) failure_ = fmt::format("{}:{}: {}", path_, node.Mark().line + 1, what);
}

void YamlMap::fail(const std::string& key, const std::string& what) {
  if (const YAML::Node node = find(key); node.IsDefined()) {
    fail(node, what);
  } else if (failure_.empty()) {
    failure_ = fmt::format("{}: {}", path_, what);
  }
}

Status YamlMap::status() const {
  if (failure_.empty()) return {};
  return Error{failure_};
}

double YamlMap::number(const YAML::Node& node, const std::string& name, double min, double max) {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    fail(node, fmt::format("{} is not a number", name));
    return 0;
  }
  if (value < min || value > max) {
    fail(node, fmt::format("{} = {} lies outside [{}, {}]", name, value, min, max));
    return 0;
  }
  return value;
}

std::optional<double> YamlMap::optional_number(const std::string& key, double min, double max) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return std::nullopt;
  return number(node, key, min, max);
}

double YamlMap::number(const std::string& key, double min, double max) {
  const std::optional<double> value = optional_number(key, min, max);
  if (!value) fail(key, fmt::format("the key '{}' is missing", key));
  return value.value_or(0);
}

int YamlMap::integer(const std::string& key, int min, int max) { return static_cast<int>(number(key, min, max)); }

std::optional<std::string> YamlMap::optional_text(const std::string& key) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return std::nullopt;
  if (!node.IsScalar()) fail(node, fmt::format("{} is not a word", key));
  return node.IsScalar() ? node.Scalar() : std::string();
}

std::vector<double> YamlMap::numbers(const std::string& key) {
  YAML::Node node = find(key);
  if (!node.IsDefined()) return {};
  if (node.IsMap()) {
    const YAML::Node& matrix = node;
    const YAML::Node data = matrix["data"];
    if (!data) {
      fail(node, fmt::format("{} is a matrix without 'data'", key));
      return {};
    }
    node.reset(data);
  }
  if (!node.IsSequence()) {
    fail(node, fmt::format("{} is not a list of numbers", key));
    return {};
  }
  constexpr double kLargest = 1e9;
  std::vector<double> values(std::min<size_t>(node.size(), 100));
  const YAML::Node& list = node;
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = number(list[i], fmt::format("number {} of {}", i + 1, key), -kLargest, kLargest);
  }
  return values;
}

void YamlMap::allow_only(std::span<const std::string> keys) {
  for (const auto& entry : root_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (std::ranges::find(keys, key) != keys.end()) continue;
    const std::string nearest = nearest_name(key, keys);
    fail(entry.first, nearest.empty() ? fmt::format("unknown key '{}'", key)
                                      : fmt::format("unknown key '{}'; did you mean '{}'?", key, nearest));
  }
}

}  // namespace photoslam::internal
