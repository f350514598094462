// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/options.h"
#include "base/random.h"
#include "splatting/model.h"

namespace photoslam {

struct DensificationOptions {
  bool enabled = true;
  int interval = 200;
  double gradient_threshold = 7e-4;
  double split_size = 0.01;
  double min_opacity = 0.03;
  double max_scale = 0.25;
  double min_weight = 0.06;
  int max_gaussians = 300000;
  bool relocation = false;
  void visit(OptionVisitor& visitor);
};

struct DensificationCounts {
  size_t cloned = 0, split = 0, pruned = 0;
};

/// Adaptive density control as in 3D Gaussian splatting (Kerbl et al. 2023), on the statistics since the last call:
/// where the screen-space gradient stays large, small gaussians are cloned and large ones split in two; children stay
/// with the parent's anchor. `scene_depth` [m] is the scale of the scene. Resets the statistics.
DensificationCounts densify(const DensificationOptions& options, double scene_depth, Random& random,
                            splatting::GaussianModel& model);

/// Removes what never weighed min_weight in a pixel since the last call, of the gaussians that enough views have
/// judged. densify() does so too. Resets the statistics.
size_t prune_idle(const DensificationOptions& options, splatting::GaussianModel& model);

/// Makes room under max_gaussians for so many newcomers: of the gaussians that enough views have judged, those go that
/// weigh least in a view's picture. With what is then seeded where the picture is wrong, gaussians move from where they
/// are idle to where they are missed.
size_t make_room(const DensificationOptions& options, size_t newcomers, splatting::GaussianModel& model);

/// Removes what exceeds max_gaussians: of all those go whose opacity, times the solid angle they cover as seen from
/// their anchor, is least. Needs no statistics, so that gaussians with and without a past compare. Returns how many.
size_t keep_budget(const DensificationOptions& options, splatting::GaussianModel& model);

/// Removes gaussians that are nearly transparent, larger than max_scale * scene_depth, or not finite.
size_t prune(const DensificationOptions& options, double scene_depth, splatting::GaussianModel& model);

}  // namespace photoslam
