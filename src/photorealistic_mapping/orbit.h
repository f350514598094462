// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "io/gaussian_ply.h"
#include "io/trajectory_file.h"

namespace photoslam {

/// Camera poses (camera_from_world) to look at a map from. With the keyframes that made it: around what all of them
/// look at, upright and about as wide as their walk was, for from there it was photographed; where they look at nothing
/// in common, as in a room, along their walk, circling around it. Without them: a circle around the middle of the
/// gaussians. The
/// map must hold gaussians.
std::vector<SE3> orbit(const GaussianTable& map, const Trajectory& keyframes, int num_frames);

}  // namespace photoslam
