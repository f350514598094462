// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "evaluation/frame_log.h"
#include "evaluation/image_score.h"
#include "evaluation/trajectory_error.h"
#include "pipeline/config.h"

namespace photoslam {

/// A figure that may not have been measured; then it is null in the file, never 0.
using Figure = std::optional<double>;
using Count = std::optional<int64_t>;

/// The content of report.json. The groups and members are its keys: a contract.
struct Report {
  struct Frames {
    Count total, tracked, lost, lost_before_init, dropped;
  };
  struct Tracking {
    Figure fps, p50_ms, p99_ms, mean_ms, min_ms, max_ms, std_ms, blocked_p99_ms, active_feature_ratio;
  };
  struct Latency {
    Figure p50_ms, p99_ms, max_ms;
  };
  struct Mapping {
    Count iterations;
    Figure ms_per_iteration;
    Count gaussians, keyframes;
    Count keyframes_without_pictures;  ///< Photorealistic mapping was too slow for them.
    Figure cpu_seconds, seconds_online, seconds_drain, seconds_refine;
  };
  struct Ate {
    Figure rmse_m, std_m, median_m, rot_rmse_deg, scale;
    Count matched;
  };
  struct Rpe {
    Figure trans_m, rot_deg;
  };
  struct Render {
    Figure fps;
  };
  struct Memory {
    Figure peak_rss_mb, gpu_mb;
  };
  struct Gpu {
    Figure utilisation;  ///< Time the GPU drew and trained over the time the photorealistic mapping took, 0 to 1.
  };
  struct MapSize {
    Figure size_mb;
  };
  struct Loops {
    Count closed, reconnected;
  };
  struct Config {
    std::vector<ConfigEntry> all, changed;
  };

  Frames frames;
  Tracking tracking;
  Latency latency;
  Mapping mapping;
  Figure seconds_total;
  Ate ate, ate_online;
  Rpe rpe;
  ImageFigures image_online;  ///< Map frozen at most 1 s after the last frame.
  ImageFigures image;         ///< Final map.
  ImageFigures image_keyframes;
  ImageFigures image_held_out;
  Render render;
  Memory memory;
  Gpu gpu;
  MapSize map;
  Loops loops;
  std::string machine;
  std::string version;
  Config config;
};

/// Counts and timings over a log of frames. Timings are over the frames that tracking saw (all but the dropped ones).
void summarize(const FrameLog& log, Report& report);

Report::Ate to_report(const std::optional<AbsoluteError>& error);
Report::Rpe to_report(const std::optional<RelativeError>& error);

/// The JSON text, every key of the contract present and in its order.
std::string to_json(const Report& report);

/// Writes report.json atomically.
Status write_report(const std::filesystem::path& path, const Report& report);

/// Reads a report back, for `eval` to renew its figures. Keys that are absent count as not measured.
Result<Report> read_report(const std::filesystem::path& path);

}  // namespace photoslam
