// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "base/ids.h"
#include "evaluation/statistics.h"
#include "image/image.h"

namespace photoslam {

/// How well a render shows one frame.
struct FrameScore {
  FrameId frame;
  int64_t timestamp_ns = 0;
  double psnr_db = 0;
  double ssim = 0;
  double share = 1;  ///< Of the pixels, those that count.
};

/// Figures over a set of frames.
struct ImageFigures {
  std::optional<double> psnr_db;     ///< Mean of the frames' PSNR.
  std::optional<double> psnr_p5_db;  ///< 5th percentile over frames.
  std::optional<double> ssim;        ///< Mean.
  std::optional<double> lpips;
  std::optional<int64_t> frames;
};

/// Scores a render (values in [0, 1], clamped) against the picture of the frame. Pixels where `mask` (empty = none) is
/// 0 do not count.
FrameScore score_frame(FrameId frame, int64_t timestamp_ns, const ImageF& render, const ImageU8& truth,
                       const ImageU8& mask = {});

/// All unset when there are no scores.
ImageFigures summarize(const std::vector<FrameScore>& scores);
/// The same of those frames alone.
ImageFigures summarize(const std::vector<FrameScore>& scores, const std::set<FrameId>& frames);

}  // namespace photoslam
