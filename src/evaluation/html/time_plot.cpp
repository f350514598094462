// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/html/time_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "evaluation/html/markup.h"
#include "evaluation/statistics.h"

namespace photoslam::html {
namespace {

// The picture in its own units; the page scales it.
constexpr double kWidth = 1000, kHeight = 220;
constexpr double kLeft = 46, kRight = 92, kTop = 12, kBottom = 26;

/// Writes the parts of one plot.
class Drawing {
 public:
  explicit Drawing(const TimePlot& plot) : plot_(plot) {}

  std::string draw() {
    add("<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\">", kWidth, kHeight);
    draw_value_axis();
    draw_time_axis();
    for (const double t : plot_.marks) {
      add("<path class=\"mark\" d=\"M{0:.1f} {1:.1f}v-7\"/>", x(t), kHeight - kBottom);
    }
    add("<path class=\"curve {}\" d=\"{}\"/>", plot_.css_class, curve());
    draw_level();
    add("</svg>\n");
    return std::move(svg_);
  }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(svg_), format, std::forward<Args>(args)...);
  }

  double x(double seconds) const { return kLeft + (kWidth - kLeft - kRight) * seconds / std::max(plot_.end_s, 1e-9); }
  double y(double value) const {
    const double share = (value - plot_.low) / std::max(plot_.high - plot_.low, 1e-9);
    return kHeight - kBottom - (kHeight - kTop - kBottom) * std::clamp(share, 0.0, 1.0);
  }

  void draw_value_axis() {
    for (const double tick : round_ticks(plot_.low, plot_.high, 5)) {
      add("<path class=\"grid\" d=\"M{} {:.1f}H{}\"/>", kLeft, y(tick), kWidth - kRight);
      add("<text class=\"tick\" text-anchor=\"end\" x=\"{}\" y=\"{:.1f}\">{:.6g}</text>", kLeft - 8, y(tick) + 4, tick);
    }
    add("<text class=\"tick\" x=\"{}\" y=\"{}\">{}</text>", kLeft + 6, kTop + 4, escape(plot_.unit));
  }

  void draw_time_axis() {
    add("<path class=\"axis\" d=\"M{} {}H{}\"/>", kLeft, kHeight - kBottom, kWidth - kRight);
    for (const double tick : round_ticks(0, plot_.end_s, 10)) {
      add("<text class=\"tick\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{}\">{:.6g}{}</text>", x(tick), kHeight - 8,
          tick, tick == 0 ? " s" : "");
    }
  }

  void draw_level() {
    if (!plot_.level) return;
    add("<path class=\"level\" d=\"M{} {:.1f}H{}\"/>", kLeft, y(*plot_.level), kWidth - kRight);
    add("<text class=\"tick\" x=\"{}\" y=\"{:.1f}\">{}</text>", kWidth - kRight + 8, y(*plot_.level) + 4,
        escape(plot_.level_label));
  }

  std::string curve() const {
    std::vector<double> times;
    for (const Vec2& point : plot_.points) times.push_back(point.x());
    const double gap = gap_threshold(times);
    std::string path;
    for (size_t i = 0; i < plot_.points.size(); ++i) {
      const Vec2& point = plot_.points[i];
      const bool connected = i > 0 && point.x() - times[i - 1] <= gap;
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", connected ? 'L' : 'M', x(point.x()), y(point.y()));
    }
    return path;
  }

  const TimePlot& plot_;
  std::string svg_;
};

}  // namespace

std::string draw(const TimePlot& plot) { return Drawing(plot).draw(); }

std::vector<double> round_ticks(double low, double high, int count) {
  if (!(high > low)) return {};
  const double rough = (high - low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= rough) step = factor * power;
  }
  std::vector<double> ticks;
  const double slack = 1e-9 * step;
  for (double i = std::ceil((low - slack) / step); i * step <= high + slack; ++i)
    ticks.push_back(i * step + 0.0);  // + 0.0: no −0
  return ticks;
}

double gap_threshold(const std::vector<double>& times) {
  std::vector<double> steps;
  for (size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return steps.empty() ? 0 : 2.5 * percentile(std::move(steps), 0.5);
}

}  // namespace photoslam::html
