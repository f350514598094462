// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/executor.h"
#include "splatting/cpu/frame.h"

namespace photoslam::splatting {

/// Culls blocks, projects their gaussians and lists the tiles each touches: fills the frame up to task_tiles.
void project_model(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor,
                   Frame& frame);

}  // namespace photoslam::splatting
