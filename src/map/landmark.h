// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/ids.h"
#include "features/orb.h"
#include "math/se3.h"

namespace photoslam {

/// Keypoint `keypoint` of keyframe `keyframe` sees a landmark.
struct LandmarkObservation {
  KeyframeId keyframe;
  int keypoint = -1;
  bool operator==(const LandmarkObservation&) const = default;
};

/// What matching needs to know of a landmark; copied into snapshots.
struct LandmarkView {
  Vec3 position = Vec3::Zero();  ///< World frame [m].
  Vec3 normal = Vec3::Zero();    ///< Mean unit direction from the observing cameras to the landmark.
  double min_distance = 0;       ///< Range of camera distances [m] at which the descriptor's scale fits the pyramid.
  double max_distance = 0;
  Descriptor descriptor{};
  bool alive = false;  ///< False after culling or fusion.
};

/// A geometric point of the hyper primitives map, owned by geometry mapping.
struct Landmark {
  LandmarkView view;
  std::vector<LandmarkObservation> observations;  ///< In order of insertion; at most one per keyframe.
  KeyframeId created_by;
  int times_visible = 1;  ///< Frames in whose view it should have been …
  int times_found = 1;    ///< … and frames that matched it.
};

}  // namespace photoslam
