// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "map/keyframe.h"
#include "map/landmark.h"

namespace photoslam {

/// How many tracked frames should have seen a landmark, and did.
struct Sighting {
  int visible = 0;
  int found = 0;
};

/// The first view of a monocular map: it becomes a keyframe only when a second view has given it landmarks.
struct InitialKeyframe {
  KeyframeId id;
  std::shared_ptr<const FeatureFrame> frame;
  SE3 camera_from_world;
  std::vector<std::pair<int, Vec3>> points;  ///< Keypoints with the point they see, in the camera frame.
};

/// A frame that tracking wants in the map.
struct KeyframeProposal {
  KeyframeId id;
  std::shared_ptr<const FeatureFrame> frame;
  KeyframeId reference;               ///< Invalid for the first keyframe of a map, …
  SE3 camera_from_reference;          ///< … whose pose this is then in the world.
  double reference_scale = 1.0;       ///< Keyframe::scale of the reference when this was made.
  std::vector<LandmarkId> landmarks;  ///< [N] matched landmark of each keypoint.
  /// Keypoints that see what a keypoint of an earlier keyframe sees, whose landmark tracking did not know yet.
  std::vector<std::pair<int, LandmarkObservation>> same_as;
  std::map<LandmarkId, Sighting> sightings;  ///< Since the proposal before.
  std::optional<InitialKeyframe> initial;    ///< To be added before this one.
};

}  // namespace photoslam
