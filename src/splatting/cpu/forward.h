// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/executor.h"
#include "splatting/cpu/frame.h"
#include "splatting/renderer.h"

namespace photoslam::splatting {

/// Model to image: project, sort, rasterize. Leaves in the frame what the way back needs.
void render_forward(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor,
                    Frame& frame, RenderResult& result, StageTimes& times);

}  // namespace photoslam::splatting
