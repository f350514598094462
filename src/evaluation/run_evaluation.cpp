// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/run_evaluation.h"

#include <algorithm>
#include <set>
#include <thread>

#include "base/clock.h"
#include "base/version.h"
#include "evaluation/map_scoring.h"
#include "pipeline/config.h"

namespace photoslam {
namespace {

FrameState log_state(const FrameOutcome& frame) {
  if (frame.dropped) return FrameState::dropped;
  if (frame.has_pose) return FrameState::tracked;
  return frame.state == TrackingState::initializing ? FrameState::initializing : FrameState::lost;
}

std::string describe_machine() {
  return fmt::format("{} cores, {}", std::thread::hardware_concurrency(), build_description());
}

ScoringTask scoring_task(const RunOutcome& run, const FrozenMap& map) {
  ScoringTask task{&map.gaussians, map.anchors_from_world, {}};
  const ExposureTrack exposures = keyframe_exposures(run, map);
  for (const FrameOutcome& frame : run.frames) {
    const auto id = static_cast<size_t>(frame.frame.value);
    if (id >= task.camera_from_world.size()) {
      task.camera_from_world.resize(id + 1);
      task.exposures.resize(id + 1);
    }
    task.camera_from_world[id] = camera_from_world(frame, map);
    task.exposures[id] = nearest_exposure(exposures, frame.timestamp_ns);
  }
  return task;
}

/// A few frames spread over the sequence, for people to look at.
std::vector<FrameId> frames_to_show(const RunOutcome& run) {
  constexpr int kPairs = 8;
  std::vector<FrameId> tracked;
  for (const FrameOutcome& frame : run.frames) {
    if (frame.has_pose) tracked.push_back(frame.frame);
  }
  std::vector<FrameId> chosen;
  for (int i = 0; i < kPairs && !tracked.empty(); ++i) {
    const size_t index = (2 * static_cast<size_t>(i) + 1) * tracked.size() / (2 * kPairs);
    if (chosen.empty() || chosen.back() != tracked[index]) chosen.push_back(tracked[index]);
  }
  return chosen;
}

void add_mapping_figures(const RunOutcome& run, Report& report) {
  report.mapping.iterations = run.iterations;
  report.mapping.gaussians = static_cast<int64_t>(run.final.gaussians.size());
  report.mapping.keyframes = static_cast<int64_t>(run.final.keyframes_from_world.size());
  report.mapping.keyframes_without_pictures = run.keyframes_without_pictures;
  report.mapping.cpu_seconds = run.mapping_cpu_seconds;
  report.mapping.seconds_online = run.seconds_online;
  report.mapping.seconds_drain = run.seconds_drain;
  report.mapping.seconds_refine = run.seconds_refine;
  report.seconds_total = run.seconds_total;
  report.loops.closed = run.loops_closed;
  report.loops.reconnected = run.loops_reconnected;
  const double seconds = run.seconds_online + run.seconds_drain + run.seconds_refine;
  if (run.iterations > 0) report.mapping.ms_per_iteration = 1e3 * seconds / run.iterations;
  if (!run.gpu) return;
  report.memory.gpu_mb = run.gpu->peak_mb;
  if (seconds > 0) report.gpu.utilisation = run.gpu->busy_seconds / seconds;
}

void add_image_figures(const RunOutcome& run, FrameSource& source, Executor& executor, HtmlReport& html) {
  const std::vector<ScoringTask> tasks = {scoring_task(run, run.final), scoring_task(run, run.online)};
  const bool refined = run.seconds_refine > 0;
  const std::vector<FrameId> shown = frames_to_show(run);
  auto scores = score_maps(source, std::span(tasks).first(refined ? 2 : 1), shown, executor);

  std::set<FrameId> keyframes, held_out;
  for (const FrameOutcome& frame : run.frames) {
    if (frame.keyframe.valid()) keyframes.insert(frame.frame);
    if (frame.held_out) held_out.insert(frame.frame);
  }
  Report& report = html.report;
  report.image = summarize(scores[0].scores);
  report.image_online = refined ? summarize(scores[1].scores) : report.image;
  report.image_keyframes = summarize(scores[0].scores, keyframes);
  report.image_held_out = summarize(scores[0].scores, held_out);
  if (scores[0].render_ms > 0) report.render.fps = 1e3 / scores[0].render_ms;
  html.scores = std::move(scores[0].scores);
  html.pairs = std::move(scores[0].pairs);
}

}  // namespace

FrameLog frame_log(const RunOutcome& run) {
  FrameLog log;
  for (const FrameOutcome& frame : run.frames) {
    FrameRecord record;
    record.frame = frame.frame;
    record.timestamp_ns = frame.timestamp_ns;
    record.state = log_state(frame);
    record.reason = frame.reason;
    record.inliers = frame.num_inliers;
    record.keyframe = frame.keyframe;
    record.latency_ms = frame.latency_ms;
    if (!frame.dropped) {
      record.queue_wait_ms = frame.queue_wait_ms;
      if (frame.tracking_ms > 0) {
        record.tracking_ms = frame.tracking_ms;
        record.blocked_ms = frame.blocked_ms;
      }
      if (frame.num_features > 0) record.active_ratio = static_cast<double>(frame.num_inliers) / frame.num_features;
    }
    log.push_back(std::move(record));
  }
  return log;
}

void evaluate_trajectories(const Trajectory& estimate, const Trajectory& online, const Trajectory& truth,
                           bool with_scale, HtmlReport& html) {
  const auto absolute = absolute_error(estimate, truth, with_scale);
  html.report.ate = to_report(absolute);
  html.report.ate_online = to_report(absolute_error(online, truth, with_scale));
  html.report.rpe = to_report(relative_error(estimate, truth, absolute ? absolute->scale : 1.0));
  html.truth = truth;
  if (absolute) html.estimate = aligned(estimate, absolute->truth_from_estimate);
}

HtmlReport evaluate_run(const RunOutcome& run, const SystemOptions& options, FrameSource& source,
                        const std::optional<Trajectory>& truth, bool with_images, Executor& executor) {
  HtmlReport html;
  html.title = source.info().name;
  html.notes = source.info().notes;
  const auto connected = connected_frames(run).size();
  const auto tracked =
      static_cast<size_t>(std::ranges::count_if(run.frames, [](const FrameOutcome& f) { return f.has_pose; }));
  if (connected < tracked) {
    html.notes.push_back(
        fmt::format("{} of {} tracked frames are in maps that could not be connected with the largest "
                    "one; the trajectory leaves them out",
                    tracked - connected, tracked));
  }
  if (options.photorealistic_mapping.exposure.enabled) {
    html.notes.emplace_back("renders have the exposure of the keyframe nearest in time, learnt from that keyframe");
  }
  html.frames = frame_log(run);
  summarize(html.frames, html.report);
  add_mapping_figures(run, html.report);
  html.report.machine = describe_machine();
  html.report.version = version();
  html.report.memory.peak_rss_mb = peak_rss_mb();
  SystemOptions used = options, defaults;
  html.report.config.all = config_values(used);
  html.report.config.changed = changed_values(used, defaults);

  for (const RefinementPoint& point : run.refinement) {
    html.refinement.emplace_back(point.seconds, point.training_psnr_db);
  }
  html.estimate = final_trajectory(run);
  if (truth) {
    evaluate_trajectories(final_trajectory(run), online_trajectory(run), *truth,
                          source.info().sensor == SensorKind::mono, html);
  }
  if (with_images) add_image_figures(run, source, executor, html);
  return html;
}

}  // namespace photoslam
