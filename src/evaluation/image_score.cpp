// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/image_score.h"

#include <algorithm>
#include <functional>
#include <iterator>

#include "image/convert.h"
#include "image/metrics.h"

namespace photoslam {

FrameScore score_frame(FrameId frame, int64_t timestamp_ns, const ImageF& render, const ImageU8& truth,
                       const ImageU8& mask) {
  const ImageF picture = to_float(render.channels() == 3 ? to_rgb(truth) : truth);
  const auto counted = mask.empty() ? 1.0
                                    : static_cast<double>(std::ranges::count_if(mask.values(), std::identity())) /
                                          static_cast<double>(mask.values().size());
  return {frame, timestamp_ns, psnr(render, picture, mask), ssim(render, picture, mask), counted};
}

ImageFigures summarize(const std::vector<FrameScore>& scores) {
  if (scores.empty()) return {};
  std::vector<double> psnrs, ssims;
  for (const FrameScore& score : scores) {
    psnrs.push_back(score.psnr_db);
    ssims.push_back(score.ssim);
  }
  ImageFigures figures;
  figures.psnr_db = describe(psnrs).mean;
  figures.psnr_p5_db = percentile(psnrs, 0.05);
  figures.ssim = describe(ssims).mean;
  figures.frames = static_cast<int64_t>(scores.size());
  return figures;
}

ImageFigures summarize(const std::vector<FrameScore>& scores, const std::set<FrameId>& frames) {
  std::vector<FrameScore> chosen;
  std::ranges::copy_if(scores, std::back_inserter(chosen),
                       [&](const FrameScore& s) { return frames.contains(s.frame); });
  return summarize(chosen);
}

}  // namespace photoslam
