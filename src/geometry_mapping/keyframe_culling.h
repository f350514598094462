// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/options.h"
#include "map/map.h"

namespace photoslam {

struct KeyframeCullingOptions {
  bool enabled = true;
  double min_redundant_share = 0.9;
  int min_other_observers = 3;
  int min_age_keyframes = 10;
  void visit(OptionVisitor& visitor);
};

/// Whether other keyframes see nearly all that this one sees, each landmark at least as sharply: then it tells bundle
/// adjustment nothing, and can become an anchor (Map::cull_keyframe).
bool is_redundant(const KeyframeCullingOptions& options, const Map& map, KeyframeId id);

}  // namespace photoslam
