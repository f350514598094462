// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_maps.h"

namespace photoslam {

Status check_session_maps(const GeometryMapper& geometry, const PhotorealisticMapper& mapper) {
  if (!geometry.is_whole()) return error("a failure has left the geometric map half changed");
  if (!mapper.is_whole()) return error("a failure has left the gaussians half changed");
  const size_t placed = geometry.map().num_keyframes(), drawn = mapper.num_keyframes();
  if (placed != drawn) return error("there are gaussians for {} of {} keyframes", drawn, placed);
  return {};
}

}  // namespace photoslam
