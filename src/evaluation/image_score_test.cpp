// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/image_score.h"

#include <gtest/gtest.h>

#include <cmath>

namespace photoslam {
namespace {

TEST(ScoreFrame, MeasuresInTheRangeZeroToOne) {
  const ImageU8 truth(20, 16, 3, 102);  // 0.4
  const ImageF render(20, 16, 3, 0.5f);
  const FrameScore score = score_frame(FrameId(7), 123, render, truth);
  EXPECT_EQ(score.frame, FrameId(7));
  EXPECT_EQ(score.timestamp_ns, 123);
  EXPECT_NEAR(score.psnr_db, 20, 1e-4);
  // Constant images: only the luminance term is not one.
  EXPECT_NEAR(score.ssim, (2 * 0.4 * 0.5 + 1e-4) / (0.16 + 0.25 + 1e-4), 1e-5);
}

TEST(ScoreFrame, ComparesAColourRenderWithAGreyCamera) {
  EXPECT_NEAR(score_frame({}, 0, ImageF(12, 12, 3, 1.0f), ImageU8(12, 12, 1, 255)).psnr_db, 100, 1e-9);
}

TEST(ScoreFrame, MaskedPixelsDoNotCount) {
  ImageF render(24, 24, 3, 0.4f);
  ImageU8 mask(24, 24, 1, 255);
  render(0, 0) = 1;
  mask(0, 0) = 0;
  EXPECT_GT(score_frame({}, 0, render, ImageU8(24, 24, 3, 102), mask).psnr_db, 99);
  EXPECT_LT(score_frame({}, 0, render, ImageU8(24, 24, 3, 102)).psnr_db, 40);
}

TEST(Summarize, ImagesByMeanAndLowTail) {
  std::vector<FrameScore> scores;
  for (int i = 0; i <= 100; ++i) scores.push_back({FrameId(i), i, 20 + 0.1 * i, 0.5 + 0.001 * i});
  const ImageFigures figures = summarize(scores);
  EXPECT_NEAR(figures.psnr_db.value(), 25, 1e-9);
  EXPECT_NEAR(figures.psnr_p5_db.value(), 20.5, 1e-9);
  EXPECT_NEAR(figures.ssim.value(), 0.55, 1e-9);
  EXPECT_EQ(figures.frames, 101);
  EXPECT_FALSE(figures.lpips.has_value());
}

TEST(Summarize, NoImagesMeansNotMeasured) {
  const ImageFigures figures = summarize(std::vector<FrameScore>{});
  EXPECT_FALSE(figures.psnr_db.has_value());
  EXPECT_FALSE(figures.frames.has_value());
}

}  // namespace
}  // namespace photoslam
