// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/loaded_session.h"

#include "pipeline/session_maps.h"

namespace photoslam {

LoadedSession::LoadedSession(const SystemOptions& options, const std::string& bytes)
    : header(session_header(bytes)),
      geometry(options.geometry_mapping, options.features, header.sensor.camera, header.bf),
      mapper(options.photorealistic_mapping, header.sensor, /*seed=*/1) {
  Archive reader(bytes);
  SessionHeader again;
  reader(again, geometry, mapper);
}

Status LoadedSession::check() const { return check_session_maps(geometry, mapper); }

}  // namespace photoslam
