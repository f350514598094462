// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "math/se3.h"

namespace photoslam {

/// A pose at a time. World axes are whatever the trajectory's author chose.
struct StampedPose {
  int64_t timestamp_ns = 0;
  SE3 world_from_camera;
};

using Trajectory = std::vector<StampedPose>;

/// Reads TUM lines "timestamp tx ty tz qx qy qz qw" (seconds; '#' starts a comment), sorted by time on return. Errors
/// name file and line. Timestamps are parsed as decimal text, without rounding through double.
Result<Trajectory> read_tum_trajectory(const std::filesystem::path& path);

/// Writes TUM lines with 9 decimals, atomically.
Status write_tum_trajectory(const std::filesystem::path& path, const Trajectory& trajectory);

/// Decimal seconds ("1305031102.175304") to nanoseconds and back, exact to the nanosecond.
Result<int64_t> parse_seconds(std::string_view text);
std::string format_seconds(int64_t timestamp_ns);

}  // namespace photoslam
