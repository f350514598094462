// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "base/result.h"
#include "camera/pinhole.h"
#include "io/gaussian_ply.h"
#include "io/trajectory_file.h"

namespace photoslam {

/// A map to look at, with what is known of the cameras that made it.
struct MapInput {
  GaussianTable map;
  std::optional<PinholeCamera> camera;  ///< Nothing: a map file does not tell.
  Trajectory keyframes;                 ///< Empty: the same.
};

/// Reads a map.ply, a session.photoslam, or the folder of a run or a merge: its map.ply or, where a killed run has left
/// none, its session.
Result<MapInput> read_map_input(const std::filesystem::path& path);

}  // namespace photoslam
