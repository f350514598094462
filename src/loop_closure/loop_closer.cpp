// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "loop_closure/loop_closer.h"

#include <algorithm>

#include "loop_closure/essential_graph.h"
#include "loop_closure/full_adjustment.h"

namespace photoslam {

void LoopClosureOptions::visit(OptionVisitor& v) {
  v.value({"enabled", "", 0, 1, "Look for places that are visited again and correct the drift since."}, enabled);
  v.value({"essential_landmarks", "", 1, 10000, "Keyframes sharing so many landmarks keep their relative pose."},
          essential_landmarks);
  v.group("detection", "When a place counts as visited again.", detection);
  v.group("pose_graph", "How the gap is spread over the loop.", pose_graph);
  v.group("bundle", "Adjustment of the whole map after a loop.", bundle);
}

LoopCloser::LoopCloser(const LoopClosureOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf)
    : options_(options), camera_(camera), bf_(bf), detector_(options.detection, orb, camera, bf, bf <= 0) {}

std::optional<MapCorrection> LoopCloser::process(const MapSnapshot& map, const std::function<bool()>& interrupted) {
  if (!options_.enabled || map.num_corrections < num_issued_) return std::nullopt;
  num_issued_ = map.num_corrections;
  num_settled_ = next_.value;
  if (map.adjustment_is_due) {
    ++num_issued_;
    return adjust_everything(options_.bundle, camera_, bf_, map, interrupted);
  }
  while (map.has(next_)) {
    const KeyframeId now = next_;
    ++next_.value;
    count_reconnection(map, now);
    std::optional<Loop> loop = detector_.detect(map, now);
    if (!loop) {
      num_settled_ = next_.value;
      continue;
    }
    ++num_issued_;
    if (loop->is_met) return recognize_landmarks(map, *loop);
    ++num_closed_;
    loops_.push_back(*loop);
    return close_loop(options_.pose_graph, options_.essential_landmarks, bf_ <= 0, map, *loop);
  }
  return std::nullopt;
}

void LoopCloser::resume(const MapSnapshot& map, int num_settled) {
  for (; map.has(next_) && next_.value < num_settled; ++next_.value) detector_.add(map, next_);
  num_issued_ = map.num_corrections;
  num_settled_ = next_.value;
}

/// The covisible keyframes of one that stays around are the last few; others in between, unless they were culled, mean
/// that the camera left and came back.
void LoopCloser::count_reconnection(const MapSnapshot& map, KeyframeId id) {
  std::vector<KeyframeId> neighbours{id};
  for (const auto& neighbour : map.keyframe(id).covisible) {
    if (neighbour.keyframe < id) neighbours.push_back(neighbour.keyframe);
  }
  std::ranges::sort(neighbours);
  bool old_place = false;
  for (size_t i = 1; i < neighbours.size(); ++i) {
    int elsewhere = 0;
    for (KeyframeId k(neighbours[i - 1].value + 1); k < neighbours[i]; ++k.value) {
      elsewhere += !map.keyframe(k).keyframe.culled;
    }
    old_place |= elsewhere + 1 >= options_.detection.min_keyframe_gap;
  }
  // A loop that was just closed shows as well; it has been counted.
  const bool just_closed = !loops_.empty() && id.value - loops_.back().now.value < options_.detection.min_keyframe_gap;
  if (old_place && !in_old_place_ && !just_closed) ++num_reconnected_;
  in_old_place_ = old_place;
}

}  // namespace photoslam
