// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/map_scoring.h"

#include <algorithm>

#include "base/clock.h"
#include "image/convert.h"
#include "photorealistic_mapping/exposure_adjustment.h"
#include "photorealistic_mapping/view_geometry.h"
#include "pipeline/frame_rectifier.h"

namespace photoslam {
namespace {

/// One frame's work, for one task.
struct Job {
  size_t task = 0;
  FrameId frame;
  int64_t timestamp_ns = 0;
  SE3 camera_from_world;
  splatting::Exposure exposure;
  const ImageU8* truth = nullptr;
  ImageU8 mask;  // empty: the camera's
  bool keep_pair = false;
  // Results.
  FrameScore score;
  ImageU8 render;
  double render_ms = 0;
};

/// Renderer and buffers of one worker.
struct Worker {
  splatting::Renderer renderer;
  splatting::RenderResult result;
  std::vector<splatting::Pose> camera_from_anchor;
  SerialExecutor serial;

  void run(const ScoringTask& task, const PinholeCamera& camera, const ImageU8& mask, Job& job) {
    camera_from_anchors(job.camera_from_world, task.anchors_from_world, camera_from_anchor);
    const Stopwatch clock;
    renderer.render(*task.gaussians, {to_splatting(camera), camera_from_anchor}, {}, serial, result);
    job.render_ms = clock.milliseconds();
    apply(job.exposure, result);
    const ImageF image = to_image(result);
    job.score = score_frame(job.frame, job.timestamp_ns, image, *job.truth, job.mask.empty() ? mask : job.mask);
    if (job.keep_pair) job.render = to_u8(image);
  }
};

}  // namespace

std::vector<MapScores> score_maps(FrameSource& source, std::span<const ScoringTask> tasks,
                                  std::span<const FrameId> pair_frames, Executor& executor) {
  const FrameRectifier rectifier(source.info());
  const ImageU8 mask = rectifier.mask();
  std::vector<Worker> workers(static_cast<size_t>(executor.concurrency()));
  std::vector<MapScores> scores(tasks.size());
  std::vector<std::vector<double>> render_ms(tasks.size());

  constexpr size_t kBatch = 16;  // frames held in memory at once
  std::vector<ImageU8> images;
  std::vector<Job> jobs;
  const auto flush = [&] {
    executor.for_each(static_cast<int>(jobs.size()), [&](int i, int worker) {
      Job& job = jobs[static_cast<size_t>(i)];
      workers[static_cast<size_t>(worker)].run(tasks[job.task], rectifier.camera(), mask, job);
    });
    for (Job& job : jobs) {
      MapScores& result = scores[job.task];
      result.scores.push_back(job.score);
      render_ms[job.task].push_back(job.render_ms);
      if (job.keep_pair) {
        result.pairs.push_back(
            {fmt::format("frame {}", job.frame.value), *job.truth, std::move(job.render), job.score});
      }
    }
    jobs.clear();
    images.clear();
  };

  images.reserve(kBatch);
  while (auto frame = source.next()) {
    if (!frame->defect.empty() || frame->color.empty()) continue;
    images.push_back(to_rgb(rectifier.color(std::move(frame->color))));
    const ImageU16 depth = rectifier.depth(std::move(frame->depth));
    for (size_t task = 0; task < tasks.size(); ++task) {
      ImageU8 chosen = tasks[task].mask ? tasks[task].mask(frame->id, depth) : ImageU8();
      const auto& poses = tasks[task].camera_from_world;
      const auto id = static_cast<size_t>(frame->id.value);
      if (id >= poses.size() || !poses[id]) continue;
      const bool keep = std::ranges::find(pair_frames, frame->id) != pair_frames.end();
      jobs.push_back({.task = task,
                      .frame = frame->id,
                      .timestamp_ns = frame->timestamp_ns,
                      .camera_from_world = *poses[id],
                      .exposure = tasks[task].exposures.empty() ? splatting::Exposure{} : tasks[task].exposures[id],
                      .truth = &images.back(),
                      .mask = std::move(chosen),
                      .keep_pair = keep,
                      .score = {},
                      .render = {}});
    }
    if (images.size() == kBatch) flush();
  }
  flush();
  for (size_t task = 0; task < tasks.size(); ++task) {
    if (!render_ms[task].empty()) scores[task].render_ms = percentile(render_ms[task], 0.5);
  }
  return scores;
}

}  // namespace photoslam
