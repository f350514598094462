// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sources/synthetic/furniture/furniture.h"

namespace photoslam::synthetic {

/// Materials of a passage's walls, enough that a piece of wall is recognised again.
std::vector<int> wall_materials(Workshop& w, double height);

/// A wall from `from` to `to` as seen from the front, made of pieces of at most 4 m, each of one of the materials.
void long_wall(Workshop& w, const Vec2& from, const Vec2& to, double height, const std::vector<int>& materials);

/// Frame of something that hangs on, or stands at, such a wall: `along` metres from `from`, facing the front.
SE3 at_wall(const Vec2& from, const Vec2& to, double along, double up);

/// A closed door in its casing, standing at a wall.
void door_leaf(Workshop& w, const SE3& frame, int timber);

/// A bright ball under the ceiling.
void ceiling_ball(Workshop& w, const Vec3& position);

}  // namespace photoslam::synthetic
