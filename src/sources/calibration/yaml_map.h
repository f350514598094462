// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace photoslam::internal {

/// A YAML file whose top level is a map, as calibration files are; OpenCV's "%YAML:1.0" first line is accepted.
///
/// The getters remember the first thing that is wrong and return a neutral value, so that a reader can take all values
/// first and ask for status() once. Nothing throws.
class YamlMap {
 public:
  static Result<YamlMap> load(const std::filesystem::path& path);

  const std::string& path() const { return path_; }
  bool has(const std::string& key) const;

  double number(const std::string& key, double min, double max);
  int integer(const std::string& key, int min, int max);
  std::optional<double> optional_number(const std::string& key, double min, double max);
  std::optional<std::string> optional_text(const std::string& key);
  /// The numbers of a list [a, b, …], or of an OpenCV matrix {rows, cols, data: […]}; empty where the key is absent.
  std::vector<double> numbers(const std::string& key);

  /// Makes keys other than these an error that names the nearest one.
  void allow_only(std::span<const std::string> keys);
  /// Remembers what is wrong with the value of a key, unless something was wrong before.
  void fail(const std::string& key, const std::string& what);
  /// The first thing that was wrong, with file and line.
  Status status() const;

 private:
  YamlMap(const YAML::Node& root, std::string path) : root_(root), path_(std::move(path)) {}
  YAML::Node find(const std::string& key) const;
  void fail(const YAML::Node& node, const std::string& what);
  double number(const YAML::Node& node, const std::string& name, double min, double max);

  YAML::Node root_;
  std::string path_;
  std::string failure_;
};

}  // namespace photoslam::internal
