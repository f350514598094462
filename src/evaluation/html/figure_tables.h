// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "evaluation/report.h"

/// The parts of report.html that show the figures of report.json.
namespace photoslam::html {

/// One sentence: frames, duration, map.
std::string lead(const Report& report);

/// The handful of figures to look at first.
std::string tiles(const Report& report);

/// All figures, in groups, and why frames of the log have no pose.
std::string tables(const Report& report, const FrameLog& log);

/// The configuration: what was changed, and everything folded away.
std::string configuration(const Report& report);

}  // namespace photoslam::html
