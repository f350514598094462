// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_view.h"

#include <algorithm>

#include "map/connected_components.h"
#include "photorealistic_mapping/world_export.h"
#include "pipeline/loaded_session.h"

namespace photoslam {
namespace {

/// [K] 1 for the keyframes of the largest part.
std::vector<uint8_t> largest_part(const std::vector<int>& component_of_keyframe) {
  int largest = 0;
  std::ptrdiff_t most = 0;
  for (const int component : component_of_keyframe) {
    const auto size = std::ranges::count(component_of_keyframe, component);
    if (size > most) largest = component, most = size;
  }
  std::vector<uint8_t> chosen;
  for (const int component : component_of_keyframe) chosen.push_back(component == largest ? 1 : 0);
  return chosen;
}

}  // namespace

Result<SessionView> view_session(const std::filesystem::path& path) {
  const auto bytes = read_session(path);
  if (!bytes) return bytes.error();
  LoadedSession session({}, *bytes);
  if (Status status = session.check(); !status) return error("{}: {}", path.string(), status.error().message);
  const auto snapshot = session.geometry.snapshot();
  const std::vector<uint8_t> chosen = largest_part(connected_components(*snapshot));
  const FrozenMap frozen = session.mapper.freeze();
  SessionView view{session.header.sensor.camera, to_world(frozen.gaussians, frozen.anchors_from_world, chosen), {}};
  for (size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i] == 0) continue;
    view.keyframes.push_back(
        {snapshot->keyframes[i]->keyframe.frame->timestamp_ns, frozen.keyframes_from_world[i].inverse()});
  }
  return view;
}

}  // namespace photoslam
