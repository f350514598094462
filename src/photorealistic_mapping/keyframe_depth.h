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
  DepthSweepOptions sweep;
  void visit(OptionVisitor& visitor);
};

/// Depths in which a keyframe's picture is searched, from those of its landmarks; without any landmarks around the
/// median depth; nothing when it has too few of them to tell.
std::optional<DepthRange> search_range(const MapSnapshot& map, const KeyframeView& view);

/// Covisible keyframes whose depth can be compared with this one's, the most covisible first: those that have one and
/// are far enough apart not to make the same mistake.
std::vector<KeyframeId> keyframes_to_compare(const KeyframeDepthOptions& options, const MapSnapshot& map, KeyframeId id,
                                             const std::function<bool(KeyframeId)>& has_depth);

/// Covisible keyframes from whose pictures depth can be swept: seen from the scene's median depth they are far enough
/// apart to measure and near enough to match; the most covisible first, at most `options.neighbours`, only those with a
/// picture.
std::vector<KeyframeId> sweep_neighbours(const KeyframeDepthOptions& options, const MapSnapshot& map, KeyframeId id,
                                         const std::function<bool(KeyframeId)>& has_picture);

}  // namespace photoslam
