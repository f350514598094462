// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "math/sim3.h"

namespace photoslam {

/// The similarity that maps `source` onto `target`, index by index, with the least sum of squared distances (Umeyama
/// 1991). Without scale the best rigid transform. At least one point; where the points leave a rotation undetermined
/// (fewer than three, or on a line) any best one is returned.
Sim3 align_umeyama(std::span<const Vec3> source, std::span<const Vec3> target, bool with_scale);

}  // namespace photoslam
