// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "base/options.h"
#include "math/sim3.h"
#include "splatting/model.h"

namespace photoslam {

struct DoublingOptions {
  bool enabled = true;
  double max_distance = 1.0;
  double max_size_ratio = 2.0;
  double max_color_difference = 0.2;
  void visit(OptionVisitor& visitor);
};

/// Merges gaussians that two passes of the same place have doubled: pairs of different keyframes that a correction of
/// the map brought together, alike in place, size and colour. The older one stays, with the opacity of the more opaque.
///
/// `before`, `after`: [anchors] anchor_from_world() around the correction. Only gaussians of the anchors in `seams`
/// count. Returns how many were removed.
size_t merge_doubled(const DoublingOptions& options, std::span<const Sim3> before, std::span<const Sim3> after,
                     std::span<const int> seams, splatting::GaussianModel& model);

}  // namespace photoslam
