// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry_mapping/keyframe_culling.h"

#include <algorithm>

namespace photoslam {

void KeyframeCullingOptions::visit(OptionVisitor& v) {
  v.value({"enabled", "", 0, 1, "Keyframes that add nothing leave bundle adjustment and stay as anchors of gaussians."},
          enabled);
  v.value({"min_redundant_share", "", 0.5, 1.0, "Share of a keyframe's landmarks that others must see as well."},
          min_redundant_share);
  v.value({"min_other_observers", "", 1, 100, "In how many other keyframes."}, min_other_observers);
  v.value({"min_age_keyframes", "", 1, 10000, "Younger keyframes always stay."}, min_age_keyframes);
}

bool is_redundant(const KeyframeCullingOptions& options, const Map& map, KeyframeId id) {
  const auto octave_of = [&map](KeyframeId keyframe, int keypoint) {
    return map.keyframe(keyframe).frame->features.keypoints[static_cast<size_t>(keypoint)].octave;
  };
  const Keyframe& keyframe = map.keyframe(id);
  int landmarks = 0, redundant = 0;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) continue;
    // Detection jitters between neighbouring levels.
    const int coarsest = octave_of(id, static_cast<int>(i)) + 1;
    const auto sees_as_well = [&](const LandmarkObservation& o) {
      return o.keyframe != id && octave_of(o.keyframe, o.keypoint) <= coarsest;
    };
    ++landmarks;
    redundant += std::ranges::count_if(map.landmark(keyframe.landmarks[i]).observations, sees_as_well) >=
                 options.min_other_observers;
  }
  return redundant >= options.min_redundant_share * landmarks;
}

}  // namespace photoslam
