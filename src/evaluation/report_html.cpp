// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/report_html.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>

#include "base/file.h"
#include "evaluation/html/figure_tables.h"
#include "evaluation/html/markup.h"
#include "evaluation/html/style.h"
#include "evaluation/html/time_plot.h"
#include "evaluation/html/trajectory_plot.h"
#include "image/convert.h"
#include "image/pyramid.h"
#include "io/image_file.h"

namespace photoslam {
namespace {

/// The page, written section after section.
class Page {
 public:
  explicit Page(const HtmlReport& content) : content_(content) {}

  Result<std::string> build() {
    add("<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n");
    add("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{} – photoslam</title>\n",
        html::escape(content_.title));
    add("<style>{}</style></head>\n<body><main>\n<p class=\"brand\">photoslam</p>\n<h1>{}</h1>\n", html::kStyle,
        html::escape(content_.title));
    page_ += html::lead(content_.report);
    for (const std::string& note : content_.notes) add("<p class=\"note\">Note: {}</p>\n", html::escape(note));
    page_ += html::tiles(content_.report);
    add_trajectories();
    if (const Status status = add_pairs(); !status) return status.error();
    add_curves();
    add("<h2>Figures</h2>\n<p class=\"note\">– means not measured.</p>\n");
    page_ += html::tables(content_.report, content_.frames);
    page_ += html::configuration(content_.report);
    add("<footer>photoslam {} · {}</footer>\n</main></body></html>\n", html::escape(content_.report.version),
        html::escape(content_.report.machine));
    return std::move(page_);
  }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(page_), format, std::forward<Args>(args)...);
  }

  void add_trajectories() {
    if (content_.estimate.empty() && content_.truth.empty()) return;
    add("<h2>Trajectory</h2>\n<p class=\"note\">Seen from above, along the direction of least motion. The camera "
        "starts "
        "at the ring and ends at the dot.</p>\n<figure><div class=\"panel\">\n");
    page_ += html::draw_trajectories(content_.estimate, content_.truth);
    add("</div><figcaption>");
    if (!content_.truth.empty()) add("<span class=\"key truth\"></span>truth");
    if (!content_.estimate.empty()) add("<span class=\"key estimate\"></span>estimate");
    add("</figcaption></figure>\n");
  }

  Status add_pairs() {
    if (content_.pairs.empty()) return {};
    add("<h2>What the map looks like</h2>\n<p class=\"note\">Left the camera's picture, right the map rendered at the "
        "estimated pose.</p>\n<div class=\"pairs\">\n");
    for (const ImagePair& pair : content_.pairs) {
      add("<figure><div class=\"pair\">");
      for (const ImageU8* image : {&pair.truth, &pair.render}) {
        const Result<std::string> jpeg = encode_jpeg(fit_to_page(*image), 88);
        if (!jpeg) return jpeg.error();
        add("<img alt=\"{}\" src=\"data:image/jpeg;base64,{}\">", image == &pair.truth ? "camera" : "render",
            html::base64(*jpeg));
      }
      add("</div><figcaption>{} · {:.2f} dB · SSIM {:.3f}</figcaption></figure>\n", html::escape(pair.label),
          pair.score.psnr_db, pair.score.ssim);
    }
    add("</div>\n");
    return {};
  }

  static ImageU8 fit_to_page(const ImageU8& image) {
    constexpr int kLargestWidth = 800;
    return shrink_color(image, 1 + (image.width() - 1) / kLargestWidth);
  }

  /// Seconds since the first input frame.
  double seconds(int64_t timestamp_ns) const { return static_cast<double>(timestamp_ns - first_time()) * 1e-9; }
  int64_t first_time() const {
    if (!content_.frames.empty()) return content_.frames.front().timestamp_ns;
    return content_.scores.empty() ? 0 : content_.scores.front().timestamp_ns;
  }
  double end_seconds() const {
    const double frames = content_.frames.empty() ? 0 : seconds(content_.frames.back().timestamp_ns);
    const double scores = content_.scores.empty() ? 0 : seconds(content_.scores.back().timestamp_ns);
    return std::max({frames, scores, 1e-3});
  }

  void add_curves() {
    const html::TimePlot plots[] = {image_plot(), error_plot(), tracking_plot(), refinement_plot()};
    if (std::ranges::all_of(plots, [](const auto& plot) { return plot.points.empty(); })) return;
    add("<h2>Over time</h2>\n");
    add_curve("Likeness of the render, PSNR per frame.", plots[0]);
    add_curve("Distance between estimated and true position after alignment.", plots[1]);
    add_curve("Time to track a frame. Red marks are frames without a pose.", plots[2]);
    add_curve("Likeness of the trained views while the map was refined after the input; running mean of PSNR.",
              plots[3]);
  }

  void add_curve(const char* caption, const html::TimePlot& plot) {
    if (plot.points.empty()) return;
    add("<figure>{}<figcaption>{}</figcaption></figure>\n", html::draw(plot), caption);
  }

  html::TimePlot empty_plot(const char* css_class, const char* unit) const {
    html::TimePlot plot;
    plot.css_class = css_class;
    plot.unit = unit;
    plot.end_s = end_seconds();
    return plot;
  }

  html::TimePlot image_plot() const {
    html::TimePlot plot = empty_plot("image", "dB");
    double low = 1e300, high = -1e300;
    for (const FrameScore& score : content_.scores) {
      plot.points.emplace_back(seconds(score.timestamp_ns), score.psnr_db);
      low = std::min(low, score.psnr_db);
      high = std::max(high, score.psnr_db);
    }
    plot.low = std::max(0.0, std::floor(low - 1));
    plot.high = std::ceil(high + 1);
    plot.level = content_.report.image.psnr_db;
    plot.level_label = fmt::format("mean {:.2f}", plot.level.value_or(0));
    return plot;
  }

  html::TimePlot error_plot() const {
    html::TimePlot plot = empty_plot("estimate", "cm");
    double high = 1e-9;
    for (const auto& [i, j] : associate(content_.estimate, content_.truth)) {
      const Vec3& estimated = content_.estimate[i].world_from_camera.translation;
      const double distance_cm = 100 * (estimated - content_.truth[j].world_from_camera.translation).norm();
      plot.points.emplace_back(seconds(content_.estimate[i].timestamp_ns), distance_cm);
      high = std::max(high, distance_cm);
    }
    plot.high = 1.1 * high;
    if (const Figure& rmse = content_.report.ate.rmse_m) plot.level = 100 * *rmse;
    plot.level_label = fmt::format("RMSE {:.2f}", plot.level.value_or(0));
    return plot;
  }

  html::TimePlot tracking_plot() const {
    html::TimePlot plot = empty_plot("time", "ms");
    std::vector<double> times;
    for (const FrameRecord& frame : content_.frames) {
      if (frame.state != FrameState::tracked) plot.marks.push_back(seconds(frame.timestamp_ns));
      if (!frame.tracking_ms) continue;
      plot.points.emplace_back(seconds(frame.timestamp_ns), *frame.tracking_ms);
      times.push_back(*frame.tracking_ms);
    }
    if (times.empty()) return plot;
    // A rare long frame must not press the curve flat; its length is in the table.
    plot.high = 1.1 * std::min(std::ranges::max(times), 2 * percentile(times, 0.99));
    plot.level = percentile(times, 0.5);
    plot.level_label = fmt::format("median {:.1f}", *plot.level);
    return plot;
  }

  html::TimePlot refinement_plot() const {
    html::TimePlot plot = empty_plot("image", "dB");
    plot.points = content_.refinement;
    if (plot.points.empty()) return plot;
    const auto [low, high] =
        std::ranges::minmax(plot.points | std::views::transform([](const Vec2& p) { return p.y(); }));
    plot.low = std::max(0.0, std::floor(low - 1));
    plot.high = std::ceil(high + 1);
    plot.end_s = std::max(plot.points.back().x(), 1e-3);
    plot.level = plot.points.back().y();
    plot.level_label = fmt::format("end {:.2f}", *plot.level);
    return plot;
  }

  const HtmlReport& content_;
  std::string page_;
};

}  // namespace

Status write_html_report(const std::filesystem::path& path, const HtmlReport& content) {
  const Result<std::string> page = Page(content).build();
  if (!page) return error("{}: {}", path.string(), page.error().message);
  return write_file_atomically(path, *page);
}

}  // namespace photoslam
