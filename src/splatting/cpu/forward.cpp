// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/forward.h"

#include "base/clock.h"
#include "splatting/cpu/project.h"
#include "splatting/cpu/rasterize.h"
#include "splatting/cpu/sort.h"

namespace photoslam::splatting {

void render_forward(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor,
                    Frame& frame, RenderResult& result, StageTimes& times) {
  Stopwatch watch;
  project_model(model, view, options, executor, frame);
  times.project = watch.milliseconds();
  watch.restart();
  distribute_to_tiles(frame);
  times.sort = watch.milliseconds();
  watch.restart();
  rasterize(executor, frame, result);
  times.forward = watch.milliseconds();
}

}  // namespace photoslam::splatting
