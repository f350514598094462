// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/report.h"
#include "image/image.h"

namespace photoslam {

/// A frame and the map's render of it.
struct ImagePair {
  std::string label;  ///< For people: "frame 100".
  ImageU8 truth;      ///< RGB or grey.
  ImageU8 render;     ///< RGB, same size.
  FrameScore score;
};

/// What report.html shows; parts that are empty are left out.
struct HtmlReport {
  std::string title;               ///< For example the name of the dataset.
  std::vector<std::string> notes;  ///< What the user should know about the input.
  Report report;
  Trajectory estimate;  ///< In the world of the truth, when there is one.
  Trajectory truth;
  FrameLog frames;
  std::vector<FrameScore> scores;  ///< By time.
  std::vector<Vec2> refinement;    ///< Seconds of refinement, PSNR of the training views [dB].
  std::vector<ImagePair> pairs;
};

/// One self-contained file: figures, both trajectories from above (truth green, estimate red), render and truth side by
/// side, curves of PSNR, tracking time and refinement. Needs neither network nor scripts. Written atomically.
Status write_html_report(const std::filesystem::path& path, const HtmlReport& content);

}  // namespace photoslam
