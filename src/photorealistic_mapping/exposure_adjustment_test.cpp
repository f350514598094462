// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/exposure_adjustment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace photoslam {
namespace {

/// Mean |gain * x + bias − y| over x in (0, 1), and its derivatives by finite differences: independent of the loss.
struct Line {
  double gain, bias;
  double loss(double g, double b) const {
    double sum = 0;
    for (int i = 0; i < 100; ++i) {
      const double x = (i + 0.5) / 100;
      sum += std::abs(g * x + b - (gain * x + bias));
    }
    return sum / 100;
  }
  std::array<float, 6> gradient(const splatting::Exposure& e) const {
    std::array<float, 6> out{};
    constexpr double kStep = 1e-5;
    for (size_t c = 0; c < 3; ++c) {
      const auto g = static_cast<double>(e.gain[c]), b = static_cast<double>(e.bias[c]);
      out[c] = static_cast<float>((loss(g + kStep, b) - loss(g - kStep, b)) / (2 * kStep));
      out[3 + c] = static_cast<float>((loss(g, b + kStep) - loss(g, b - kStep)) / (2 * kStep));
    }
    return out;
  }
};

TEST(ExposureAdjustment, FindsGainAndBias) {
  const Line truth{1.2, -0.03};
  ExposureAdjustment adjustment;
  ExposureOptions options;
  options.decay = 0;
  options.bias_rate = 0.001;
  for (int i = 0; i < 1500; ++i) adjustment.step(options, 1.0 - i / 1500.0, truth.gradient(adjustment.exposure()));
  for (const size_t c : {0u, 1u, 2u}) {
    EXPECT_NEAR(static_cast<double>(adjustment.exposure().gain[c]), truth.gain, 0.01);
    EXPECT_NEAR(static_cast<double>(adjustment.exposure().bias[c]), truth.bias, 0.01);
  }
}

TEST(ExposureAdjustment, WithoutEvidenceItReturnsToIdentity) {
  ExposureAdjustment adjustment;
  const Line truth{1.2, -0.03};
  for (int i = 0; i < 30; ++i) adjustment.step({}, 1.0, truth.gradient(adjustment.exposure()));
  ASSERT_GT(adjustment.exposure().gain[0], 1.05f);
  // The decay of 0.001 takes a factor of 20 in 3000 steps; Adam's momentum first goes on for a while.
  for (int i = 0; i < 3400; ++i) adjustment.step({}, 1.0, std::array<float, 6>{});
  EXPECT_NEAR(adjustment.exposure().gain[0], 1, 0.01);
  EXPECT_NEAR(adjustment.exposure().bias[0], 0, 0.01);
}

TEST(ExposureAdjustment, ABrokenGradientIsIgnored) {
  ExposureAdjustment adjustment;
  adjustment.step({}, 1.0, std::array<float, 6>{std::numeric_limits<float>::quiet_NaN()});
  EXPECT_EQ(adjustment.exposure().gain[0], 1);
}

TEST(ExposureAdjustment, MatchesTheBrightnessOfARenderWhereItIsOpaque) {
  constexpr int kWidth = 20, kHeight = 10;
  constexpr size_t kPlane = kWidth * kHeight;
  splatting::RenderResult render;
  render.width = kWidth;
  render.height = kHeight;
  render.rgb.resize(3 * kPlane);
  render.alpha.resize(kPlane);
  DepthPicture picture;
  picture.color = ImageU8(kWidth, kHeight, 3);
  const float gains[3] = {0.8f, 1.1f, 1.3f};
  for (size_t i = 0; i < kPlane; ++i) {
    render.alpha[i] = i % 2 == 0 ? 0.9f : 0.1f;
    for (size_t c = 0; c < 3; ++c) {
      const float color = 0.2f + 0.4f * static_cast<float>(i) / kPlane;
      render.rgb[c * kPlane + i] = i % 2 == 0 ? color : 0.1f * color;
      picture.color.values()[3 * i + c] = static_cast<uint8_t>(std::lround(255 * gains[c] * color));
    }
  }
  ExposureAdjustment adjustment;
  adjustment.match(picture, render);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(adjustment.exposure().gain[c], gains[c], 0.01f);

  ExposureAdjustment unchanged;
  std::ranges::fill(render.alpha, 0.3f);
  unchanged.match(picture, render);
  EXPECT_EQ(unchanged.exposure().gain[0], 1) << "nothing opaque to compare with";
}

/// A render of stripes, and the picture of it with another exposure, shifted sideways by some pixels.
double matched_gain(double gain, int shift) {
  constexpr int kWidth = 64, kHeight = 8, kStripe = 8;
  splatting::RenderResult render;
  render.width = kWidth;
  render.height = kHeight;
  render.alpha.assign(kWidth * kHeight, 1.0f);
  render.rgb.resize(3 * render.alpha.size());
  DepthPicture picture;
  picture.color = ImageU8(kWidth, kHeight, 3);
  const auto stripes = [&](int x) { return (x + kStripe) / kStripe % 2 == 0 ? 0.2 : 0.9; };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (size_t c = 0; c < 3; ++c) {
        render.rgb[c * render.alpha.size() + static_cast<size_t>(y * kWidth + x)] = static_cast<float>(stripes(x));
        picture.color(x, y, static_cast<int>(c)) = static_cast<uint8_t>(std::lround(255 * gain * stripes(x + shift)));
      }
    }
  }
  ExposureAdjustment adjustment;
  adjustment.match(picture, render);
  return static_cast<double>(adjustment.exposure().gain[1]);
}

TEST(ExposureAdjustment, ARenderThatDoesNotFitCountsLittle) {
  EXPECT_NEAR(matched_gain(0.7, 0), 0.7, 0.01);
  EXPECT_NEAR(matched_gain(0.7, 8), 1.0, 0.02) << "bright stripes where dark ones are drawn";
  EXPECT_NEAR(matched_gain(1.0, 3), 1.0, 0.02) << "misplaced stripes are no change of brightness";
}

TEST(ExposureAdjustment, AMapThatLetsBlackThroughButRendersThePictureIsNotDarkened) {
  constexpr int kWidth = 16, kHeight = 16;
  splatting::RenderResult render;
  render.width = kWidth;
  render.height = kHeight;
  render.alpha.assign(kWidth * kHeight, 0.9f);
  render.rgb.assign(3 * render.alpha.size(), 0.6f);
  DepthPicture picture;
  picture.color = ImageU8(kWidth, kHeight, 3);
  std::ranges::fill(picture.color.values(), uint8_t{153});  // 0.6 of 255
  ExposureAdjustment adjustment;
  adjustment.match(picture, render);
  for (const float gain : adjustment.exposure().gain) EXPECT_NEAR(gain, 1.0f, 1e-5f);
}

TEST(ExposureAdjustment, PixelsWithoutDataAreNoDarkness) {
  constexpr int kWidth = 16, kHeight = 16;
  splatting::RenderResult render;
  render.width = kWidth;
  render.height = kHeight;
  render.alpha.assign(kWidth * kHeight, 1.0f);
  render.rgb.assign(3 * render.alpha.size(), 0.5f);
  DepthPicture picture;
  picture.color = ImageU8(kWidth, kHeight, 3);
  picture.mask = ImageU8(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 4; x < kWidth; ++x) {
      picture.mask(x, y) = 255;
      for (int c = 0; c < 3; ++c) picture.color(x, y, c) = 102;  // 0.4; the columns without data stay black
    }
  }
  ExposureAdjustment adjustment;
  adjustment.match(picture, render);
  for (const float gain : adjustment.exposure().gain) EXPECT_NEAR(gain, 0.8f, 1e-5f);
}

TEST(ExposureAdjustment, AColorWithTheExposureRemovedRendersAsThePicture) {
  constexpr float kSh0 = 0.28209479177387814f;
  const splatting::Exposure exposure{{1.25f, 0.8f, 1.0f}, {0.02f, -0.05f, 0.0f}};
  splatting::Gaussian gaussian;
  for (float& value : gaussian.sh[0]) value = (0.6f - 0.5f) / kSh0;
  remove(exposure, gaussian);
  splatting::RenderResult render;
  render.width = render.height = 1;
  render.alpha = {1.0f};
  for (const float value : gaussian.sh[0]) render.rgb.push_back(0.5f + kSh0 * value);
  apply(exposure, render);
  for (const float value : render.rgb) EXPECT_NEAR(value, 0.6f, 1e-6f);
}

}  // namespace
}  // namespace photoslam
