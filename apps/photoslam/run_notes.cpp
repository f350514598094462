// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "run_notes.h"

#include <fmt/format.h>

namespace photoslam {
namespace {

void add_lost_frames(const RunOutcome& run, std::vector<std::string>& notes) {
  constexpr size_t kShown = 3;
  bool had_pose = false;
  size_t lost = 0;
  for (const FrameOutcome& frame : run.frames) {
    had_pose |= frame.has_pose;
    if (!had_pose || frame.has_pose || frame.dropped) continue;
    if (++lost <= kShown) notes.push_back(fmt::format("frame {} is lost: {}", frame.frame.value, frame.reason));
  }
  if (lost > kShown) notes.push_back(fmt::format("{} more frames are lost: see frames.csv", lost - kShown));
}

}  // namespace

std::vector<std::string> notes_on(const RunOutcome& run, const RunSettings& settings) {
  std::vector<std::string> notes;
  add_lost_frames(run, notes);
  const bool waits = settings.pace == Pace::realtime || settings.logical_time || settings.deterministic;
  if (!waits && !settings.localize_only && static_cast<size_t>(run.iterations) < run.frames.size()) {
    notes.push_back(
        fmt::format("the map has had only {} training iterations for {} frames, which did not wait for it; "
                    "--iterations-per-frame 4 makes them wait, --refine-seconds 30 goes on training after them",
                    run.iterations, run.frames.size()));
  }
  return notes;
}

std::string why_nothing_was_mapped(const RunOutcome& run, SensorKind sensor) {
  std::string why = run.frames.empty() ? "no frame was read" : run.frames.back().reason;
  if (!run.failure.empty()) return why + " (" + run.failure + ")";
  if (run.interrupted) return why + " until it was interrupted";
  if (sensor == SensorKind::rgbd && !run.frames.empty()) {
    why += "; depth counts between depth.min_m and depth.max_m: is depth_scale in the calibration right?";
  }
  return why;
}

}  // namespace photoslam
