// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/snapshot.h"

namespace photoslam {

KeyframeId MapSnapshot::root_of(KeyframeId id) const {
  while (keyframe(id).keyframe.parent.valid()) id = keyframe(id).keyframe.parent;
  return id;
}

const LandmarkView* MapSnapshot::find(LandmarkId& id) const {
  while (id.valid() && id.value < num_landmarks) {
    const auto chunk = static_cast<size_t>(id.value / kChunk);
    const LandmarkView& view = (*landmark_chunks[chunk])[static_cast<size_t>(id.value % kChunk)];
    if (view.alive) return &view;
    id = view.replaced_by;
  }
  return nullptr;
}

}  // namespace photoslam
