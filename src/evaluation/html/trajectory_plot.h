// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "io/trajectory_file.h"

namespace photoslam::html {

/// Both trajectories from above as SVG: the truth (may be empty) in green, the estimate in red, with a scale bar.
/// "Above" is the direction in which the camera moved least.
std::string draw_trajectories(const Trajectory& estimate, const Trajectory& truth);

}  // namespace photoslam::html
