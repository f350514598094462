// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "loop_closure/essential_graph.h"

#include <algorithm>
#include <utility>

#include "math/median.h"

namespace photoslam {
namespace {

PoseGraph essential_graph(const MapSnapshot& map, int min_shared) {
  PoseGraph graph;
  for (const auto& view : map.keyframes) {
    graph.pose_from_world.emplace_back(view->keyframe.camera_from_world);
    graph.pose_is_fixed.push_back(view->keyframe.parent.valid() ? 0 : 1);
  }
  constexpr double kTypicalShared = 100;
  constexpr int kLeastShared = 15;  // of keyframes that count as covisible; parents may have lost some
  const auto connect = [&](KeyframeId a, KeyframeId b, int shared) {
    const Sim3 &a_from_world = graph.pose_from_world[static_cast<size_t>(a.value)],
               &b_from_world = graph.pose_from_world[static_cast<size_t>(b.value)];
    graph.edges.push_back({a.value, b.value, b_from_world * a_from_world.inverse(), shared / kTypicalShared});
  };
  for (const auto& view : map.keyframes) {
    const Keyframe& keyframe = view->keyframe;
    int shared_with_parent = kLeastShared;
    for (const auto& [other, shared] : view->covisible) {
      if (other == keyframe.parent) shared_with_parent = shared;
      const bool in_tree = other == keyframe.parent || map.keyframe(other).keyframe.parent == keyframe.id;
      if (shared >= min_shared && other < keyframe.id && !in_tree) connect(other, keyframe.id, shared);
    }
    if (keyframe.parent.valid()) connect(keyframe.parent, keyframe.id, shared_with_parent);
  }
  return graph;
}

/// Moves the younger of two maps so that the loop is met. Returns by which keyframe it now hangs on which.
std::pair<KeyframeId, KeyframeId> join_maps(const MapSnapshot& map, const Loop& loop, PoseGraph& graph) {
  const KeyframeId then_root = map.root_of(loop.then), now_root = map.root_of(loop.now);
  const bool now_moves = then_root < now_root;
  const KeyframeId moving_root = now_moves ? now_root : then_root;
  const auto pose = [&](KeyframeId id) -> Sim3& { return graph.pose_from_world[static_cast<size_t>(id.value)]; };
  const Sim3 old_from_new_world = now_moves ? pose(loop.now).inverse() * loop.now_from_then * pose(loop.then)
                                            : pose(loop.then).inverse() * loop.now_from_then.inverse() * pose(loop.now);
  for (const auto& view : map.keyframes) {
    const KeyframeId id = view->keyframe.id;
    if (map.root_of(id) == moving_root) pose(id) = pose(id) * old_from_new_world;
  }
  graph.pose_is_fixed[static_cast<size_t>(moving_root.value)] = 0;
  return now_moves ? std::pair(loop.now, loop.then) : std::pair(loop.then, loop.now);
}

double typical_depth(const MapSnapshot& map) {
  std::vector<double> depths;
  for (const auto& view : map.keyframes) {
    if (view->median_depth > 0) depths.push_back(view->median_depth);
  }
  return depths.empty() ? 1.0 : lower_median(depths);
}

}  // namespace

MapCorrection close_loop(const PoseGraphOptions& options, int min_shared, bool with_scale, const MapSnapshot& map,
                         const Loop& loop) {
  PoseGraph graph = essential_graph(map, min_shared);
  const std::vector<Sim3> before = graph.pose_from_world;
  MapCorrection correction = recognize_landmarks(map, loop);
  correction.adjustment_is_due = true;
  if (map.root_of(loop.then) != map.root_of(loop.now)) {
    correction.joints.push_back(join_maps(map, loop, graph));
  }
  // One exact observation against long chains of others: the loop is to be met, not to be averaged away.
  constexpr double kLoopWeight = 100;
  graph.edges.push_back({loop.then.value, loop.now.value, loop.now_from_then, kLoopWeight});
  optimize_pose_graph(options, with_scale, typical_depth(map), graph);

  for (size_t i = 0; i < before.size(); ++i) {
    correction.new_world_from_old_world.push_back(graph.pose_from_world[i].inverse() * before[i]);
  }
  return correction;
}

MapCorrection recognize_landmarks(const MapSnapshot& map, const Loop& loop) {
  MapCorrection correction;
  const Keyframe& now = map.keyframe(loop.now).keyframe;
  for (const auto& [landmark, keypoint] : loop.matches) {
    LandmarkId present = now.landmarks[static_cast<size_t>(keypoint)];
    if (map.find(present) != nullptr && present != landmark) correction.duplicates.emplace_back(present, landmark);
  }
  correction.loop_landmarks = loop.landmarks;
  correction.loop_keyframes.push_back(loop.now);
  for (const auto& neighbour : map.keyframe(loop.now).covisible) {
    correction.loop_keyframes.push_back(neighbour.keyframe);
  }
  return correction;
}

}  // namespace photoslam
