// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "io/trajectory_file.h"

namespace photoslam {

/// Where the dataset folder keeps its true trajectory (groundtruth.txt; traj.txt, also beside a results/ folder;
/// mav0/state_groundtruth_estimate0/data.csv or mav0/mocap0/data.csv; poses/NN.txt of KITTI); nothing where it has
/// none. For evaluation only.
std::optional<std::filesystem::path> find_ground_truth(const std::filesystem::path& dataset);

/// Reads a true trajectory of the (left) camera as it is mounted, not rectified: a dataset folder, a TUM file, a
/// Replica traj.txt (16 numbers of the row-major world_from_camera matrix per line, 30 frames per second), an EuRoC
/// data.csv (poses of the body, taken to cam0 by its T_BS), or a KITTI poses/NN.txt (12 numbers per line,
/// world_from_cam0; taken to the camera that is read). For evaluation only.
Result<Trajectory> read_ground_truth(const std::filesystem::path& path);

}  // namespace photoslam
