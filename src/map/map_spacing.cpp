// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/map_spacing.h"

#include <algorithm>
#include <cmath>

namespace photoslam {

int next_free_place(const MapSnapshot& map) {
  int next = 0;
  for (const auto& view : map.keyframes) {
    const double x = view->keyframe.camera_from_world.inverse().translation.x();
    next = std::max(next, 1 + static_cast<int>(std::lround(x / kMapSpacing)));
  }
  return next;
}

}  // namespace photoslam
