// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <memory>

#include "base/archive.h"
#include "map/snapshot.h"

namespace photoslam {

/// The geometric map has changed: by a keyframe that entered it or, without one, by a loop. Or it is to be saved.
struct MapUpdate {
  std::shared_ptr<const MapSnapshot> map;
  KeyframeId keyframe;
  std::shared_ptr<const KeyframeImages> images;  ///< Null: the keyframe is added without pictures.
  std::shared_ptr<Archive> session;  ///< Or, without a map: header and geometric map, to be completed and saved.
};

/// What photorealistic mapping is asked to do: first take over the change, if there is one, then train.
struct MappingMessage {
  MapUpdate update;    ///< Without a map: nothing has changed.
  int iterations = 0;  ///< By logical time: so many, now.
};

/// What the queue of photorealistic mapping forgets, so that it takes little memory though nobody waits for it: poses
/// that newer ones replace, old maps, and pictures beyond a limit. No keyframe is lost.
class MappingQueueLimit {
 public:
  /// For all pictures that wait, but those of one keyframe always fit.
  explicit MappingQueueLimit(double pictures_mb) : limit_bytes_(1e6 * pictures_mb) {}

  /// As Stage::Work::make_way.
  void make_way(const MappingMessage& newer, std::deque<MappingMessage>& waiting);

  /// Keyframes that have lost their pictures to the limit. From any thread.
  int num_without_pictures() const { return num_without_pictures_; }

 private:
  double limit_bytes_;
  std::atomic<int> num_without_pictures_{0};
};

/// Memory of a keyframe's pictures.
size_t bytes_of(const KeyframeImages& images);

}  // namespace photoslam
