// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"
#include "splatting/loss.h"

namespace photoslam {

/// The exposure of a keyframe, by its time.
struct StampedExposure {
  int64_t timestamp_ns = 0;
  splatting::Exposure exposure;
};

using ExposureTrack = std::vector<StampedExposure>;

/// Of the entry nearest in time, the earlier of two equally near; identity when the track is empty. The track is sorted
/// by time.
splatting::Exposure nearest_exposure(const ExposureTrack& track, int64_t timestamp_ns);

/// Writes exposures.txt, atomically: a first line with name and version of the format, then lines "timestamp gain_r
/// gain_g gain_b bias_r bias_g bias_b" (seconds; colours in [0, 1]), to be read back exactly.
Status write_exposures(const std::filesystem::path& path, const ExposureTrack& track);

/// Reads it back, sorted by time. Errors name file and line; gains are positive.
Result<ExposureTrack> read_exposures(const std::filesystem::path& path);

}  // namespace photoslam
