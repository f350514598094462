// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "geometry_mapping/geometry_mapper.h"
#include "photorealistic_mapping/photorealistic_mapper.h"

namespace photoslam {

/// Whether two maps can be those of one session: both whole, with the same keyframes. Only such are ever written. The
/// error says what is wrong.
Status check_session_maps(const GeometryMapper& geometry, const PhotorealisticMapper& mapper);

}  // namespace photoslam
