// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "io/trajectory_file.h"

namespace photoslam {

/// Where the dataset folder keeps its true trajectory (groundtruth.txt or traj.txt, also beside a results/ folder);
/// nothing where it has none. For evaluation only.
std::optional<std::filesystem::path> find_ground_truth(const std::filesystem::path& dataset);

/// Reads a true trajectory: a dataset folder, a TUM file, or a Replica traj.txt (16 numbers of the row-major
/// world_from_camera matrix per line, 30 frames per second). For evaluation only.
Result<Trajectory> read_ground_truth(const std::filesystem::path& path);

}  // namespace photoslam
