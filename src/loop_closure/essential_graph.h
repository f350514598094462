// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "loop_closure/loop_detector.h"
#include "map/map_correction.h"
#include "map/snapshot.h"
#include "optimization/pose_graph.h"

namespace photoslam {

/// Closes a loop: spreads the gap between where `now` is and where the loop says it should be over the essential graph
/// (spanning tree, pairs of keyframes sharing at least `min_shared` landmarks, the loop). Pairs weigh as much as they
/// share landmarks: most of the gap has come about where the map hangs by a thread. Keyframes without parent stay. The
/// adjustment of everything is due then.
MapCorrection close_loop(const PoseGraphOptions& options, int min_shared, bool with_scale, const MapSnapshot& map,
                         const Loop& loop);

/// Makes one of the landmarks that a loop shows to be the same; nothing moves.
MapCorrection recognize_landmarks(const MapSnapshot& map, const Loop& loop);

}  // namespace photoslam
