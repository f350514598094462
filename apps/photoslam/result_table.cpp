// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "result_table.h"

#include <fmt/format.h>

#include <iterator>

namespace photoslam {
namespace {

class Table {
 public:
  template <class... Args>
  void line(const char* name, fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), "  {:<18}", name);
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    text_ += '\n';
  }
  std::string text() && { return std::move(text_); }

 private:
  std::string text_;
};

void add_images(Table& table, const char* name, const ImageFigures& figures) {
  if (!figures.psnr_db) return;
  table.line(name, "PSNR {:.2f} dB (5 % of the frames below {:.2f}), SSIM {:.3f}, {} frames", *figures.psnr_db,
             figures.psnr_p5_db.value_or(0), figures.ssim.value_or(0), figures.frames.value_or(0));
}

void add_ate(Table& table, const char* name, const Report::Ate& ate) {
  if (!ate.rmse_m) return;
  table.line(name, "ATE {:.2f} cm RMSE, {:.2f} cm median, {:.2f} deg, {} poses", 100 * *ate.rmse_m,
             100 * ate.median_m.value_or(0), ate.rot_rmse_deg.value_or(0), ate.matched.value_or(0));
}

}  // namespace

std::string result_table(const Report& report) {
  Table table;
  const Report::Frames& frames = report.frames;
  table.line("frames", "{} of {} tracked, {} lost ({} before the first pose), {} dropped", frames.tracked.value_or(0),
             frames.total.value_or(0), frames.lost.value_or(0), frames.lost_before_init.value_or(0),
             frames.dropped.value_or(0));
  if (report.tracking.p50_ms) {
    table.line("tracking", "{:.1f} ms median, {:.1f} ms p99, {:.1f} frames/s", *report.tracking.p50_ms,
               report.tracking.p99_ms.value_or(0), report.tracking.fps.value_or(0));
  }
  add_ate(table, "trajectory", report.ate);
  add_ate(table, "  as published", report.ate_online);
  if (report.rpe.trans_m) {
    table.line("  over 1 s", "RPE {:.2f} cm, {:.2f} deg", 100 * *report.rpe.trans_m, report.rpe.rot_deg.value_or(0));
  }
  if (report.mapping.iterations) {
    const auto& m = report.mapping;
    table.line("map", "{} gaussians, {} keyframes, {} training iterations in {:.1f} s", m.gaussians.value_or(0),
               m.keyframes.value_or(0), *m.iterations,
               m.seconds_online.value_or(0) + m.seconds_drain.value_or(0) + m.seconds_refine.value_or(0));
  }
  add_images(table, "images online", report.image_online);
  add_images(table, "images", report.image);
  add_images(table, "  of keyframes", report.image_keyframes);
  add_images(table, "  held out", report.image_held_out);
  if (report.render.fps) table.line("rendering", "{:.0f} frames/s on one core", *report.render.fps);
  if (report.memory.peak_rss_mb) table.line("memory", "{:.0f} MB at most", *report.memory.peak_rss_mb);
  if (report.gpu.utilisation) {
    table.line("GPU", "{:.0f} MB at most, busy {:.0f} % of the time", report.memory.gpu_mb.value_or(0),
               100 * *report.gpu.utilisation);
  }
  if (report.seconds_total) table.line("time", "{:.1f} s", *report.seconds_total);
  return std::move(table).text();
}

}  // namespace photoslam
