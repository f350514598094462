// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_merge.h"

#include <algorithm>

#include "map/connected_components.h"
#include "pipeline/session_file.h"

namespace photoslam {
namespace {

struct LoadedSession {
  SessionHeader header;
  GeometryMapper geometry;
  PhotorealisticMapper mapper;

  LoadedSession(const SystemOptions& options, const std::string& bytes)
      : header(session_header(bytes)),
        geometry(options.geometry_mapping, options.features, header.sensor.camera, header.bf),
        mapper(options.photorealistic_mapping, header.sensor, /*seed=*/1) {
    Archive reader(bytes);
    SessionHeader again;
    reader(again, geometry, mapper);
  }
};

int count_parts(const MapSnapshot& map) {
  const std::vector<int> component = connected_components(map);
  return component.empty() ? 0 : 1 + std::ranges::max(component);
}

}  // namespace

Result<MergedSessions> merge_sessions(const SystemOptions& options, const std::string& first, const std::string& second,
                                      Executor& executor) {
  LoadedSession one(options, first), two(options, second);
  if (Status fits = check_session_sensor(one.header, two.header.sensor.camera, two.header.bf); !fits) {
    return fits.error();
  }

  LoopCloser closer(options.loop_closure, options.features, one.header.sensor.camera, one.header.bf);
  auto map = one.geometry.snapshot();
  closer.resume(*map);
  const int num_parts = count_parts(*map) + count_parts(*two.geometry.snapshot());
  const auto num_keyframes_of_first = static_cast<int>(map->keyframes.size());
  one.geometry.append(two.geometry);
  one.mapper.append(std::move(two.mapper));
  map = one.geometry.snapshot();
  while (const auto correction = closer.process(*map)) map = one.geometry.correct(*correction);
  if (count_parts(*map) == num_parts) {
    return error("no place of the second session was recognised in the first: they cannot be joined");
  }
  one.mapper.update_poses(*map);
  while (one.mapper.has_seams()) one.mapper.train(std::nullopt, executor);

  MergedSessions merged;
  merged.session(one.header, one.geometry, one.mapper);
  merged.map = one.mapper.freeze();
  for (const auto& view : map->keyframes) merged.keyframe_times_ns.push_back(view->keyframe.frame->timestamp_ns);
  merged.component_of_keyframe = connected_components(*map);
  merged.num_keyframes_of_first = num_keyframes_of_first;
  merged.num_loops = closer.num_closed();
  return merged;
}

}  // namespace photoslam
