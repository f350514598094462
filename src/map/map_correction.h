// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "math/sim3.h"

namespace photoslam {

/// How a loop changes the map: a message from loop closure to geometry mapping, computed on a snapshot. The map may
/// have grown and moved since; corrections are relative, so that nothing of that is lost.
struct MapCorrection {
  /// [K] by KeyframeId of the snapshot: the world around each keyframe moves by this. Empty: nothing moves.
  std::vector<Sim3> new_world_from_old_world = {};
  /// Moves in addition to that of the oldest observer [m, new world].
  std::map<LandmarkId, Vec3> landmark_shifts = {};

  /// Whether everything is to be adjusted after this, or has been by this. Nothing: what was due stays due.
  std::optional<bool> adjustment_is_due = {};
  /// Maps of their own until now: that of the first keyframe hangs by it on the second.
  std::vector<std::pair<KeyframeId, KeyframeId>> joints = {};
  /// Landmarks that are the same point: the first is to become the second.
  std::vector<std::pair<LandmarkId, LandmarkId>> duplicates = {};
  /// Landmarks that these keyframes do not see after all.
  std::vector<std::pair<LandmarkId, KeyframeId>> wrong_observations = {};
  /// Where more duplicates are to be sought: these landmarks in these keyframes.
  std::vector<LandmarkId> loop_landmarks = {};
  std::vector<KeyframeId> loop_keyframes = {};
};

}  // namespace photoslam
