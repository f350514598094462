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
    const LandmarkChunk& chunk = *landmark_chunks[static_cast<size_t>(id.value / LandmarkChunk::kSize)];
    const int slot = id.value % LandmarkChunk::kSize;
    if (const LandmarkView* view = chunk.find(slot)) return view;
    id = chunk.replacement(slot);
  }
  return nullptr;
}

}  // namespace photoslam
