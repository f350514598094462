// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "base/executor.h"
#include "splatting/model.h"
#include "splatting/renderer.h"
#include "splatting/target_image.h"
#include "splatting/trainer.h"
#include "splatting/view.h"

namespace photoslam::splatting {

/// One view to train on.
struct BenchView {
  Camera camera;
  Pose camera_from_model;  ///< Every anchor alike.
  TargetImage target;
};

struct BenchReport {
  size_t gaussians = 0;
  double visible = 0;  ///< Median over the iterations.
  int iterations = 0;
  double wall_ms = 0;                   ///< Of all iterations together.
  double iteration_ms = 0;              ///< Median.
  double render_ms = 0;                 ///< Median of rendering alone.
  StageTimes stages;                    ///< Medians.
  float loss_first = 0, loss_last = 0;  ///< Of the first and the last round, mean over the views.
};

/// Real optimisation steps (the mapper's own) over all views, `rounds` times, after one round to warm up; then renders
/// them. Changes the model. Nothing is kept between steps but buffers. Of a GPU, steps are timed as the caller sees
/// them, rendering without the way of the image to the host.
BenchReport bench_training(GaussianModel& model, std::span<const BenchView> views, int rounds,
                           const TrainOptions& options, Executor& executor, const std::shared_ptr<Gpu>& gpu = {});

/// What the machine can do, to compare figures between machines.
struct MachineProbe {
  double fma_gflops = 0;  ///< Fused multiply-adds from registers, all workers [1e9 operations/s, two per FMA].
  double triad_gbs = 0;   ///< a[i] = b[i] + s c[i] beyond the caches, all workers [1e9 bytes/s, 3 arrays].
};
MachineProbe probe_machine(Executor& executor);

/// Name of the SIMD target that dispatch chooses on this machine ("AVX3", "AVX2", "SSE4", "NEON").
const char* simd_target();

}  // namespace photoslam::splatting
