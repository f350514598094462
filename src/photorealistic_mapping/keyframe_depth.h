// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "base/options.h"
#include "geometry/depth_sweep.h"
#include "map/snapshot.h"

namespace photoslam {

struct KeyframeDepthOptions {
  bool enabled = true;
  double min_unexplained = 0.05;
  int spare_iterations = 50;
  int neighbours = 2;
  double min_parallax = 0.02;
  double max_parallax = 0.30;
  double agreement = 0.05;
  DepthSweepOptions sweep;
  void visit(OptionVisitor& visitor);
};

/// Depths in which a keyframe's picture is searched, from those of its landmarks; without any landmarks around the
/// median depth; nothing when it has too few of them to tell.
std::optional<DepthRange> search_range(const MapSnapshot& map, const KeyframeView& view);

/// Covisible keyframes whose depth can confirm this one's, the most covisible first: those that have one.
std::vector<KeyframeId> confirming_keyframes(const MapSnapshot& map, KeyframeId id,
                                             const std::function<bool(KeyframeId)>& has_depth);

/// Covisible keyframes from whose pictures depth can be swept: seen from the scene's median depth they are far enough
/// apart to measure and near enough to match; the most covisible first, at most `options.neighbours`, only those with a
/// picture.
std::vector<KeyframeId> sweep_neighbours(const KeyframeDepthOptions& options, const MapSnapshot& map, KeyframeId id,
                                         const std::function<bool(KeyframeId)>& has_picture);

}  // namespace photoslam
