// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/sensor_choice.h"

#include <algorithm>

#include "base/check.h"

namespace photoslam {

std::string sensor_name(SensorKind sensor) {
  switch (sensor) {
    case SensorKind::mono:
      return "mono";
    case SensorKind::stereo:
      return "stereo";
    case SensorKind::rgbd:
      return "rgbd";
  }
  return "?";
}

Result<std::optional<SensorKind>> parse_sensor(const std::string& name) {
  if (name == "auto") return std::optional<SensorKind>();
  for (const SensorKind sensor : {SensorKind::mono, SensorKind::stereo, SensorKind::rgbd}) {
    if (name == sensor_name(sensor)) return std::optional(sensor);
  }
  return error("unknown sensor '{}'; there are auto, mono, stereo and rgbd", name);
}

namespace internal {

Result<SensorKind> choose_sensor(std::optional<SensorKind> asked, std::span<const SensorKind> available,
                                 const std::string& dataset) {
  PHOTOSLAM_CHECK(!available.empty(), "{} has no sensor", dataset);
  if (!asked) return available.front();
  if (std::ranges::find(available, *asked) != available.end()) return *asked;
  std::string names;
  for (const SensorKind sensor : available) names += (names.empty() ? "" : " or ") + sensor_name(sensor);
  return error("{} can be read as {}, not as {}", dataset, names, sensor_name(*asked));
}

}  // namespace internal
}  // namespace photoslam
