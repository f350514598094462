// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_merge.h"

#include <algorithm>
#include <span>

#include "map/connected_components.h"
#include "map/map_spacing.h"
#include "pipeline/loaded_session.h"

namespace photoslam {
namespace {

/// A session's keyframes may lie anywhere: moves it to where nothing of the other is in sight.
void move_beside(const MapSnapshot& other, LoadedSession& session) {
  const SE3 aside(Quat::Identity(), Vec3(kMapSpacing * next_free_place(other), 0, 0));
  MapCorrection correction;
  correction.new_world_from_old_world.assign(session.geometry.map().num_keyframes(), Sim3(aside));
  session.mapper.update_poses(*session.geometry.correct(correction));
}

/// Whether some part holds keyframes of both sessions.
bool are_joined(std::span<const int> component_of_keyframe, size_t num_keyframes_of_first) {
  const auto first = component_of_keyframe.first(num_keyframes_of_first),
             second = component_of_keyframe.subspan(num_keyframes_of_first);
  return std::ranges::find_first_of(first, second) != first.end();
}

}  // namespace

Result<MergedSessions> merge_sessions(const SystemOptions& options, const std::string& first, const std::string& second,
                                      Executor& executor) {
  LoadedSession one(options, first), two(options, second);
  for (const auto& [session, which] : {std::pair{&one, "first"}, {&two, "second"}}) {
    const Status maps = session->check();
    if (!maps) return error("the {} session cannot be continued: {}", which, maps.error().message);
  }
  if (Status fits = check_session_sensor(one.header, two.header.sensor.camera, two.header.bf); !fits) {
    return fits.error();
  }

  LoopCloser closer(options.loop_closure, options.features, one.header.sensor.camera, one.header.bf);
  auto map = one.geometry.snapshot();
  closer.resume(*map, one.header.num_settled);
  const size_t num_keyframes_of_first = map->keyframes.size();
  move_beside(*map, two);
  one.geometry.append(two.geometry);
  one.mapper.append(std::move(two.mapper));
  map = one.geometry.snapshot();
  while (const auto correction = closer.process(*map)) map = one.geometry.correct(*correction);
  std::vector<int> component_of_keyframe = connected_components(*map);
  if (!are_joined(component_of_keyframe, num_keyframes_of_first)) {
    return error("no place of the second session was recognised in the first: they cannot be joined");
  }
  one.mapper.update_poses(*map);
  while (one.mapper.has_seams()) one.mapper.train(std::nullopt, executor);

  MergedSessions merged;
  one.header.num_settled = closer.num_settled();
  merged.session(one.header, one.geometry, one.mapper);
  merged.map = one.mapper.freeze();
  for (const auto& view : map->keyframes) merged.keyframe_times_ns.push_back(view->keyframe.frame->timestamp_ns);
  merged.component_of_keyframe = std::move(component_of_keyframe);
  merged.num_keyframes_of_first = static_cast<int>(num_keyframes_of_first);
  merged.num_loops = closer.num_closed();
  return merged;
}

}  // namespace photoslam
