// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "geometry_mapping/geometry_mapper.h"
#include "photorealistic_mapping/photorealistic_mapper.h"
#include "pipeline/session_file.h"

namespace photoslam {

/// A session as read_session() gives it, with both of its maps in memory.
struct LoadedSession {
  SessionHeader header;
  GeometryMapper geometry;
  PhotorealisticMapper mapper;

  LoadedSession(const SystemOptions& options, const std::string& bytes);
  /// See check_session_maps().
  Status check() const;
};

}  // namespace photoslam
