// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "math/se3.h"

namespace photoslam {

/// The view that the others can do without best: the older one of the two that look most alike. Views differ by the
/// distance of their centres, relative to the depth of the scene [m], and by the angle between them [rad]. There must
/// be two at least, in order of age; the last one is never chosen.
size_t most_redundant_view(std::span<const SE3> cameras_from_world, double scene_depth);

}  // namespace photoslam
