// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <stop_token>

#include "pipeline/run_settings.h"
#include "pipeline/system_options.h"
#include "sources/frame.h"

namespace photoslam {

/// Where a run stands, for people.
struct Progress {
  enum class Phase { online, draining, refining, done };
  Phase phase = Phase::online;
  int frames = 0;      ///< Processed so far …
  int num_frames = 0;  ///< … of so many; 0 when unknown.
  TrackingState state = TrackingState::initializing;
  double frames_per_second = 0;
  int dropped = 0;
  int keyframes = 0;
  size_t gaussians = 0;
  int iterations = 0;
  double training_psnr_db = 0;
  double refined = 0;                 ///< Share of the refinement done, [0, 1].
  std::vector<std::string> messages;  ///< What has failed since the last report without ending the run.
  // With RunSettings::preview only.
  std::shared_ptr<const KeyframeComparison> comparison;  ///< Null until there is one.
  std::vector<Vec3> positions;                           ///< Of the camera so far, as published [m].
};

/// Whether frames of a source can continue a session (its bytes): the error says what differs.
Status check_session(const std::string& session, const SystemOptions& options, const SourceInfo& info);

/// Photo-SLAM: localization, geometry mapping and photorealistic mapping in parallel on one hyper primitives map
/// (paper, Sec. 3). Consumes the source to its end or until `stop`, trains on every keyframe, refines, and returns
/// trajectory and map. `on_progress` is called on this thread a few times a second.
///
/// Never throws for bad data. When a component throws, the run ends early with RunOutcome::failure set and everything
/// made so far.
RunOutcome run_slam(const SystemOptions& options, const RunSettings& settings, FrameSource& source,
                    std::stop_token stop = {}, const std::function<void(const Progress&)>& on_progress = {});

}  // namespace photoslam
