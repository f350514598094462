// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "map/snapshot.h"

namespace photoslam {

/// Maps that are not connected have worlds of their own. They lie beside each other along x, each around a multiple of
/// this, so that nothing of one is ever seen in another [m].
constexpr double kMapSpacing = 1e4;

/// The first multiple of kMapSpacing beyond all keyframes: where the next map may begin.
int next_free_place(const MapSnapshot& map);

}  // namespace photoslam
