// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/executor.h"
#include "evaluation/image_score.h"
#include "evaluation/report_html.h"
#include "pipeline/run_settings.h"
#include "sources/frame.h"

namespace photoslam {

/// A map and the poses to look at it from.
struct ScoringTask {
  const splatting::GaussianModel* gaussians = nullptr;
  std::span<const SE3> anchors_from_world;            // [anchors of gaussians]
  std::vector<std::optional<SE3>> camera_from_world;  ///< [frames of the source] by FrameId; nothing: not scored.
  std::vector<splatting::Exposure> exposures = {};    ///< The same; empty: all are identity.
  /// Asked for every frame in turn, with its undistorted depth where there is one: which pixels count (0: not). An
  /// empty mask: all of which the camera has data.
  std::function<ImageU8(FrameId, const ImageU16& depth)> mask = {};
};

struct MapScores {
  std::vector<FrameScore> scores;  ///< By frame.
  std::vector<ImagePair> pairs;    ///< Of the frames asked for.
  double render_ms = 0;            ///< Median time of one image on one core.
};

/// Renders every frame of the source at its pose, in the undistorted camera, and compares: masked where there is no
/// data, clamped to [0, 1], with the exposure that the task tells, never fitted to the image. The source is read once
/// for all tasks; frames that it cannot deliver are left out. `pair_frames` are those whose pictures are kept.
std::vector<MapScores> score_maps(FrameSource& source, std::span<const ScoringTask> tasks,
                                  std::span<const FrameId> pair_frames, Executor& executor);

}  // namespace photoslam
