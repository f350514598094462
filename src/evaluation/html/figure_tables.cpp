// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/html/figure_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>
#include <variant>

#include "evaluation/html/markup.h"

namespace photoslam::html {
namespace {

constexpr std::string_view kAbsent = "<span class=\"absent\">–</span>";

/// A figure times `factor` with so many decimals and its unit, or a dash.
std::string show(const Figure& figure, int decimals, const char* unit, double factor = 1) {
  if (!figure) return std::string(kAbsent);
  return fmt::format("{:.{}f}{}{}", factor * *figure, decimals, *unit == '\0' ? "" : " ", unit);
}

/// A whole number in groups of three digits.
std::string show(const Count& count) {
  if (!count) return std::string(kAbsent);
  std::string digits = std::to_string(*count);
  const size_t first = *count < 0 ? 1 : 0;
  for (size_t i = digits.size(); i > first + 3; i -= 3) digits.insert(i - 3, "\u202f");
  return digits;
}

class Table {
 public:
  explicit Table(const char* caption) : html_(fmt::format("<table><caption>{}</caption>\n", caption)) {}
  Table& row(std::string_view name, const std::string& value) {
    html_ += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", name, value);
    return *this;
  }
  std::string text() const { return html_ + "</table>\n"; }

 private:
  std::string html_;
};

std::string trajectory_table(const char* caption, const Report::Ate& ate) {
  return Table(caption)
      .row("position error, RMSE", show(ate.rmse_m, 2, "cm", 100))
      .row("median", show(ate.median_m, 2, "cm", 100))
      .row("standard deviation", show(ate.std_m, 2, "cm", 100))
      .row("rotation error, RMSE", show(ate.rot_rmse_deg, 2, "°"))
      .row("scale", show(ate.scale, 4, ""))
      .row("poses compared", show(ate.matched))
      .text();
}

std::string image_table(const char* caption, const ImageFigures& image) {
  if (!image.frames) return {};
  return Table(caption)
      .row("PSNR, mean of frames", show(image.psnr_db, 2, "dB"))
      .row("PSNR, 5th percentile", show(image.psnr_p5_db, 2, "dB"))
      .row("SSIM", show(image.ssim, 4, ""))
      .row("LPIPS", show(image.lpips, 4, ""))
      .row("frames", show(image.frames))
      .text();
}

std::string frames_table(const Report::Frames& frames) {
  return Table("Frames")
      .row("input", show(frames.total))
      .row("tracked", show(frames.tracked))
      .row("lost", show(frames.lost))
      .row("of these before the first pose", show(frames.lost_before_init))
      .row("dropped", show(frames.dropped))
      .text();
}

/// Why frames have no pose, the most frequent reasons first.
std::string reasons(const FrameLog& log) {
  std::map<std::string, int64_t> counts;
  for (const FrameRecord& frame : log) {
    if (frame.state == FrameState::tracked) continue;
    ++counts[frame.reason.empty() ? to_string(frame.state) : frame.reason];
  }
  if (counts.empty()) return {};
  std::vector<std::pair<int64_t, std::string>> ordered;
  for (const auto& [reason, count] : counts) ordered.emplace_back(-count, reason);
  std::ranges::sort(ordered);
  constexpr size_t kShown = 8;
  Table table("Frames without a pose");
  for (size_t i = 0; i < std::min(kShown, ordered.size()); ++i) {
    table.row(escape(ordered[i].second), show(Count(-ordered[i].first)));
  }
  if (ordered.size() > kShown) table.row("other reasons", show(Count(static_cast<int64_t>(ordered.size() - kShown))));
  return table.text();
}

std::string tracking_table(const Report& report) {
  const Report::Tracking& t = report.tracking;
  return Table("Tracking time per frame")
      .row("median", show(t.p50_ms, 1, "ms"))
      .row("99th percentile", show(t.p99_ms, 1, "ms"))
      .row("mean", show(t.mean_ms, 1, "ms"))
      .row("shortest – longest", show(t.min_ms, 1, "") + " – " + show(t.max_ms, 1, "ms"))
      .row("standard deviation", show(t.std_ms, 1, "ms"))
      .row("blocked, 99th percentile", show(t.blocked_p99_ms, 1, "ms"))
      .row("frames per second", show(t.fps, 1, ""))
      .row("features with a landmark", show(t.active_feature_ratio, 1, "%", 100))
      .row("latency, median", show(report.latency.p50_ms, 1, "ms"))
      .row("latency, 99th percentile", show(report.latency.p99_ms, 1, "ms"))
      .text();
}

std::string mapping_table(const Report& report) {
  const Report::Mapping& m = report.mapping;
  return Table("Map")
      .row("gaussians", show(m.gaussians))
      .row("keyframes", show(m.keyframes))
      .row("keyframes without pictures", show(m.keyframes_without_pictures))
      .row("iterations", show(m.iterations))
      .row("time per iteration", show(m.ms_per_iteration, 1, "ms"))
      .row("processor time of mapping", show(m.cpu_seconds, 1, "s"))
      .row("online", show(m.seconds_online, 1, "s"))
      .row("until the queue was empty", show(m.seconds_drain, 1, "s"))
      .row("refinement", show(m.seconds_refine, 1, "s"))
      .row("file size", show(report.map.size_mb, 1, "MB"))
      .row("loops closed", show(report.loops.closed))
      .row("loops reconnected", show(report.loops.reconnected))
      .text();
}

std::string resource_table(const Report& report) {
  return Table("Resources")
      .row("duration of the run", show(report.seconds_total, 1, "s"))
      .row("memory, peak", show(report.memory.peak_rss_mb, 0, "MB"))
      .row("GPU memory, peak", show(report.memory.gpu_mb, 0, "MB"))
      .row("GPU, part of the time at work", show(report.gpu.utilisation, 0, "%", 100))
      .row("rendering, frames per second", show(report.render.fps, 1, ""))
      .text();
}

std::string tile(const std::string& number, const char* unit, const std::string& meaning) {
  return fmt::format("<div class=\"tile\"><b>{}<small>{}</small></b><span>{}</span></div>\n", number, unit, meaning);
}

std::string to_text(const ConfigValue& value) {
  return escape(std::visit([](const auto& v) { return fmt::format("{}", v); }, value));
}

std::string configuration_table(const std::vector<ConfigEntry>& entries) {
  std::string html = "<table>\n";
  for (const ConfigEntry& entry : entries) {
    html += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escape(entry.key), to_text(entry.value));
  }
  return html + "</table>\n";
}

}  // namespace

std::string lead(const Report& report) {
  std::string text = fmt::format("{} frames", show(report.frames.total));
  if (report.seconds_total) text += fmt::format(", {:.1f} seconds from start to finish", *report.seconds_total);
  if (report.mapping.gaussians) text += fmt::format(", a map of {} gaussians", show(report.mapping.gaussians));
  return "<p class=\"lead\">" + text + "</p>\n";
}

std::string tiles(const Report& report) {
  std::string html = "<div class=\"tiles\">\n";
  if (report.frames.total) {
    html += tile(show(report.frames.tracked), "", fmt::format("of {} frames tracked", show(report.frames.total)));
  }
  if (report.tracking.p50_ms) {
    html += tile(show(report.tracking.p50_ms, 1, ""), "ms",
                 fmt::format("to track a frame, 99 % within {}", show(report.tracking.p99_ms, 0, "ms")));
  }
  if (report.ate.rmse_m) html += tile(show(report.ate.rmse_m, 2, "", 100), "cm", "position error (ATE RMSE)");
  if (report.image_online.psnr_db && report.image_online.psnr_db != report.image.psnr_db) {
    html += tile(show(report.image_online.psnr_db, 2, ""), "dB", "PSNR online");
  }
  if (report.image.psnr_db) {
    html += tile(show(report.image.psnr_db, 2, ""), "dB",
                 fmt::format("PSNR of the final map, SSIM {}", show(report.image.ssim, 3, "")));
  }
  return html + "</div>\n";
}

std::string tables(const Report& report, const FrameLog& log) {
  std::string html = "<div class=\"tables\">\n";
  html += frames_table(report.frames) + reasons(log) + tracking_table(report);
  if (report.ate.rmse_m) html += trajectory_table("Final trajectory", report.ate);
  if (report.ate_online.rmse_m) html += trajectory_table("Trajectory as published online", report.ate_online);
  if (report.rpe.trans_m) {
    html += Table("Drift over one second")
                .row("position, RMSE", show(report.rpe.trans_m, 2, "cm", 100))
                .row("rotation, RMSE", show(report.rpe.rot_deg, 2, "°"))
                .text();
  }
  html += image_table("Renders of the map as it was online", report.image_online);
  html += image_table("Renders of the final map", report.image);
  html += image_table("Renders at keyframes", report.image_keyframes);
  html += image_table("Renders at frames never trained on", report.image_held_out);
  html += mapping_table(report) + resource_table(report);
  return html + "</div>\n";
}

std::string configuration(const Report& report) {
  if (report.config.all.empty()) return {};
  std::string html = "<h2>Configuration</h2>\n";
  if (report.config.changed.empty()) {
    html += "<p class=\"note\">The default configuration, nothing changed.</p>\n";
  } else {
    html += "<p class=\"note\">Changed from the defaults:</p>\n" + configuration_table(report.config.changed);
  }
  return html + "<details><summary>All values</summary>\n" + configuration_table(report.config.all) + "</details>\n";
}

}  // namespace photoslam::html
