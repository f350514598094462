// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "base/executor.h"
#include "evaluation/report_html.h"
#include "pipeline/run_settings.h"
#include "pipeline/system_options.h"
#include "sources/frame.h"

namespace photoslam {

/// The log of a run as frames.csv holds it.
FrameLog frame_log(const RunOutcome& run);

/// Measures a finished run: timings, trajectory error against the truth (where there is one), and renders of all
/// tracked frames at their final poses against a second reading of the source. The first to see the truth.
///
/// `source` must deliver the same frames as the run's; `truth` is that of the camera that is tracked, see
/// read_true_trajectory(). `with_images` false leaves all image figures unset.
HtmlReport evaluate_run(const RunOutcome& run, const SystemOptions& options, FrameSource& source,
                        const std::optional<Trajectory>& truth, bool with_images, Executor& executor);

/// Trajectory figures only.
void evaluate_trajectories(const Trajectory& estimate, const Trajectory& online, const Trajectory& truth,
                           bool with_scale, HtmlReport& html);

}  // namespace photoslam
