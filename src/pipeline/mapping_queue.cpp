// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/mapping_queue.h"

#include <algorithm>
#include <ranges>
#include <vector>

namespace photoslam {
namespace {

bool brings_only_poses(const MappingMessage& message) {
  return message.update.map && !message.update.keyframe.valid() && message.iterations == 0;
}

/// Whatever waits sees the newest map, except before a session: that is to be saved with the map it has.
void take_newest_map(const MappingMessage& newer, std::deque<MappingMessage>& waiting) {
  if (!newer.update.map) return;
  for (MappingMessage& message : std::views::reverse(waiting)) {
    if (message.update.session) return;
    if (message.update.map) message.update.map = newer.update.map;
  }
}

/// A keyframe whose pictures leave the smallest hole between its neighbours that have some, so that no part of the walk
/// loses all of them. The first that waits stays while others can go: where a map begins there is nothing else to train
/// on.
MappingMessage& most_dispensable(const std::vector<MappingMessage*>& with_pictures, KeyframeId newest) {
  MappingMessage* best = with_pictures.front();
  int smallest = 0;
  for (size_t i = 1; i < with_pictures.size(); ++i) {
    const bool is_last = i + 1 == with_pictures.size();
    const KeyframeId next = is_last ? newest : with_pictures[i + 1]->update.keyframe;
    const int hole = next.value - with_pictures[i - 1]->update.keyframe.value;
    if (smallest > 0 && hole >= smallest) continue;
    smallest = hole;
    best = with_pictures[i];
  }
  return *best;
}

}  // namespace

size_t bytes_of(const KeyframeImages& images) {
  return images.color.values().size_bytes() + images.depth.values().size_bytes() + images.right.values().size_bytes() +
         images.mask.values().size_bytes();
}

void MappingQueueLimit::make_way(const MappingMessage& newer, std::deque<MappingMessage>& waiting) {
  if (newer.update.map && !waiting.empty() && brings_only_poses(waiting.back())) waiting.pop_back();
  take_newest_map(newer, waiting);
  if (!newer.update.images) return;
  std::vector<MappingMessage*> with_pictures;
  auto bytes = static_cast<double>(bytes_of(*newer.update.images));
  for (MappingMessage& message : waiting) {
    MapUpdate& update = message.update;
    if (!update.images) continue;
    if (update.map->keyframe(update.keyframe).keyframe.culled) {
      update.images.reset();
      continue;
    }
    with_pictures.push_back(&message);
    bytes += static_cast<double>(bytes_of(*update.images));
  }
  while (bytes > limit_bytes_ && !with_pictures.empty()) {
    MappingMessage& chosen = most_dispensable(with_pictures, newer.update.keyframe);
    bytes -= static_cast<double>(bytes_of(*chosen.update.images));
    chosen.update.images.reset();
    ++num_without_pictures_;
    std::erase(with_pictures, &chosen);
  }
}

}  // namespace photoslam
