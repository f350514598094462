// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/executor.h"
#include "splatting/cpu/frame.h"
#include "splatting/trainer.h"

namespace photoslam::splatting {

/// Sums the gradient records of each visible gaussian in order, carries them back to its parameters and lets Adam use
/// them at once (gradients of the 48 colour coefficients are never stored). Statistics are updated, too.
/// `pose` receives the pose gradient. With options.update == false only the pose gradient is computed.
void update_model(Executor& executor, Frame& frame, const TrainOptions& options, GaussianModel& model, float pose[6]);

/// The same gradients written out instead of used.
void dense_gradients(Executor& executor, Frame& frame, const GaussianModel& model, Gradients& gradients);

}  // namespace photoslam::splatting
