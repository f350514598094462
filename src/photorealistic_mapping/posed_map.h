// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "camera/pinhole.h"
#include "map/snapshot.h"

namespace photoslam {

/// The geometric map of pictures whose poses are known from elsewhere, as photorealistic mapping takes it: every camera
/// is a keyframe, and sees those of the points [M] (world frame; of any number, also none) that lie in its image.
/// Cameras are covisible by the points they share; without points, by nearness of place and direction.
std::shared_ptr<const MapSnapshot> posed_map(const PinholeCamera& camera, std::span<const SE3> cameras_from_world,
                                             std::span<const Vec3> points);

/// The point nearest to all optical axes: what a circle of pictures looks at. Behind or infinitely far for parallel
/// cameras; then one unit before the first.
Vec3 focus_point(std::span<const SE3> cameras_from_world);

}  // namespace photoslam
