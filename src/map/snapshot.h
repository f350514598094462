// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "map/keyframe.h"
#include "map/landmark_chunk.h"

namespace photoslam {

/// Keyframes sharing landmarks, strongest first.
struct CovisibleKeyframe {
  KeyframeId keyframe;
  int shared_landmarks = 0;
};

/// A keyframe as readers see it.
struct KeyframeView {
  Keyframe keyframe;
  std::vector<CovisibleKeyframe> covisible;
  double median_depth = 0;  ///< Of its landmarks [m]; 0 when it has none.
};

/// An unchanging picture of the map. Parts that did not change are shared with earlier snapshots, so publishing costs
/// what changed.
class MapSnapshot {
 public:
  uint64_t version = 0;
  int num_corrections = 0;                                            ///< MapCorrections that have been applied.
  bool adjustment_is_due = false;                                     ///< Of everything, since a loop was closed.
  std::vector<std::shared_ptr<const KeyframeView>> keyframes;         ///< [K] by KeyframeId.
  std::vector<std::shared_ptr<const LandmarkChunk>> landmark_chunks;  ///< By LandmarkId / LandmarkChunk::kSize.
  int num_landmarks = 0;                                              ///< Ids given out, dead ones included.

  bool has(KeyframeId id) const { return id.valid() && static_cast<size_t>(id.value) < keyframes.size(); }
  const KeyframeView& keyframe(KeyframeId id) const { return *keyframes[static_cast<size_t>(id.value)]; }

  /// The keyframe, or the parent that it follows since it was culled.
  KeyframeId living(KeyframeId id) const { return keyframe(id).keyframe.culled ? keyframe(id).keyframe.parent : id; }
  /// The root of the spanning tree that a keyframe is in: each map of its own has one.
  KeyframeId root_of(KeyframeId id) const;

  /// The landmark, or the one that replaced it; nullptr when it is dead or not part of this snapshot. `id` is updated.
  const LandmarkView* find(LandmarkId& id) const;
};

}  // namespace photoslam
