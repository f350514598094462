// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "sources/frame.h"
#include "sources/ground_truth.h"

namespace photoslam {

/// Reads a true trajectory (see read_ground_truth()) of the camera whose poses a run of this source estimates. Datasets
/// tell that of the left camera as it is mounted; of a stereo pair the rectified left camera is tracked, which has the
/// same centre and other axes. Everything that compares estimate and truth reads the truth here.
Result<Trajectory> read_true_trajectory(const std::filesystem::path& path, const SourceInfo& source);

/// The trajectory of the source's left camera turned into that of the camera that is tracked.
Trajectory of_tracked_camera(Trajectory of_left_camera, const SourceInfo& source);

}  // namespace photoslam
