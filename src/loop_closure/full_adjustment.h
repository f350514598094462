// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "map/map_correction.h"
#include "map/snapshot.h"
#include "optimization/bundle_adjustment.h"

namespace photoslam {

/// Bundle adjustment of all keyframes and landmarks. Keyframes without parent stay where they are, and one more of
/// each map where no depth was measured, so that its size stays too. What fits nowhere near is left out, and is to
/// leave the map. An interrupted adjustment stays due.
MapCorrection adjust_everything(const BundleOptions& options, const PinholeCamera& camera, double bf,
                                const MapSnapshot& map, const std::function<bool()>& interrupted = {});

}  // namespace photoslam
