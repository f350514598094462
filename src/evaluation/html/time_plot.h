// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "math/se3.h"

namespace photoslam::html {

/// A curve over time, drawn as SVG.
struct TimePlot {
  std::string css_class;        ///< Of the curve.
  std::string unit;             ///< Of the values: "ms", "dB", …
  std::vector<Vec2> points;     ///< Time [s] and value, by time; the curve is interrupted across gaps.
  double low = 0, high = 1;     ///< Ends of the value axis; what lies outside is cut off.
  double end_s = 1;             ///< End of the time axis, which begins at 0.
  std::optional<double> level;  ///< A horizontal line to compare with,
  std::string level_label;      ///< and its name.
  std::vector<double> marks;    ///< Times [s] at which something went wrong.
};

std::string draw(const TimePlot& plot);

/// Round numbers 1, 2 or 5 times a power of ten, `count` of them or somewhat fewer between low and high.
std::vector<double> round_ticks(double low, double high, int count);

/// Interval of time beyond which two neighbours of an increasing list are not connected: 2.5 times the usual one.
double gap_threshold(const std::vector<double>& times);

}  // namespace photoslam::html
