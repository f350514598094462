// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "base/result.h"
#include "sources/frame.h"

namespace photoslam {

/// "mono", "stereo", "rgbd".
std::string sensor_name(SensorKind sensor);

/// The sensor of a name, or of none for "auto".
Result<std::optional<SensorKind>> parse_sensor(const std::string& name);

namespace internal {

/// The sensor that was asked for, where the data of `dataset` have it; the first of those they have where none was.
Result<SensorKind> choose_sensor(std::optional<SensorKind> asked, std::span<const SensorKind> available,
                                 const std::string& dataset);

}  // namespace internal
}  // namespace photoslam
