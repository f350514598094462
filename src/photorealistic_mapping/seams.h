// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "camera/pinhole.h"
#include "map/snapshot.h"
#include "math/sim3.h"

namespace photoslam {

/// The frame in which the gaussians of a keyframe stay as they are: that of its camera, in the unit of its birth.
Sim3 anchor_from_world(const SE3& camera_from_world, double scale);

/// Where a correction of the map has left seams: keyframes in whose picture what a covisible keyframe brought along has
/// moved by more than `min_shift_px`, in ascending order. `before`: [V] anchor_from_world() of the first V keyframes
/// before the correction; only these count.
std::vector<int> find_seams(double min_shift_px, const PinholeCamera& camera, const MapSnapshot& after,
                            std::span<const Sim3> before);

}  // namespace photoslam
