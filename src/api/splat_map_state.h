// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "io/gaussian_ply.h"
#include "photoslam/splat_map.h"
#include "splatting/model.h"

namespace photoslam {

struct SplatMap::State {
  GaussianTable table;             ///< For files.
  splatting::GaussianModel model;  ///< For rendering: one anchor, the world.
};

/// Makes public maps out of what the system produces.
struct SplatMapAccess {
  static SplatMap make(GaussianTable table);
};

}  // namespace photoslam
