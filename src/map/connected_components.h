// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "map/snapshot.h"

namespace photoslam {

/// Which keyframes are in one world: [K] number of the connected part each belongs to, from 0 in the order of their
/// first keyframes. Keyframes are connected through their parents in the spanning tree and through covisibility; parts
/// that are not have worlds of their own, whose relative pose (and scale, for a single camera) nobody knows.
std::vector<int> connected_components(const MapSnapshot& map);

}  // namespace photoslam
