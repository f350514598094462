// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"

namespace photoslam {
namespace {

/// Two similar pictures given by formulas, so that other programs can be asked about the same pixels.
ImageF formula_image(bool distorted) {
  ImageF image(61, 47, 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        const double envelope = std::cos(0.05 * x * c - 0.23 * y);
        image(x, y, c) = static_cast<float>(distorted ? 0.48 + 0.35 * std::sin(0.30 * x + 0.18 * y + c) * envelope +
                                                            0.03 * std::sin(2.1 * x + 1.3 * y)
                                                      : 0.5 + 0.4 * std::sin(0.31 * x + 0.17 * y + c) * envelope);
      }
    }
  }
  return image;
}

ImageF noisy(const ImageF& image, double sigma, uint64_t seed) {
  Random random(seed);
  ImageF result = image;
  for (float& v : result.values()) v += static_cast<float>(sigma * random.normal());
  return result;
}

/// The definition, term by term in double precision: windows without masked pixels, variances about the window's mean.
double slow_ssim(const ImageF& a, const ImageF& b, const ImageU8& mask = {}) {
  double sum = 0;
  int count = 0;
  for (int c = 0; c < a.channels(); ++c) {
    for (int y = 5; y < a.height() - 5; ++y) {
      for (int x = 5; x < a.width() - 5; ++x) {
        const auto mean = [&](auto&& value) {
          double total = 0, weights = 0;
          for (int dy = -5; dy <= 5; ++dy) {
            for (int dx = -5; dx <= 5; ++dx) {
              const double w = std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5));
              total += w * value(x + dx, y + dy);
              weights += w;
            }
          }
          return total / weights;
        };
        if (!mask.empty() && mean([&](int u, int v) { return mask(u, v) == 0 ? 1.0 : 0.0; }) > 0) continue;
        const auto va = [&](int u, int v) { return std::clamp<double>(a(u, v, c), 0, 1); };
        const auto vb = [&](int u, int v) { return std::clamp<double>(b(u, v, c), 0, 1); };
        const double ma = mean(va), mb = mean(vb);
        const double saa = mean([&](int u, int v) { return std::pow(va(u, v) - ma, 2); });
        const double sbb = mean([&](int u, int v) { return std::pow(vb(u, v) - mb, 2); });
        const double sab = mean([&](int u, int v) { return (va(u, v) - ma) * (vb(u, v) - mb); });
        sum += (2 * ma * mb + 1e-4) * (2 * sab + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (saa + sbb + 9e-4));
        ++count;
      }
    }
  }
  return sum / count;
}

TEST(Psnr, OfAConstantDifferenceIsItsLogarithm) {
  const ImageF a(8, 6, 3, 0.5f), b(8, 6, 3, 0.625f);
  EXPECT_NEAR(psnr(a, b), -20 * std::log10(0.125), 1e-9);
  EXPECT_EQ(psnr(a, a), kLargestPsnr);
}

TEST(Psnr, AgreesWithScikitImage) {
  EXPECT_NEAR(psnr(formula_image(false), formula_image(true)), 24.77013847210518, 1e-5);
}

TEST(Psnr, ClampsToWhatAScreenShows) {
  ImageF a(2, 1, 1, 1.0f), b(2, 1, 1, 1.0f);
  b(0, 0) = 7.0f;
  EXPECT_EQ(psnr(a, b), kLargestPsnr);
  b(0, 0) = std::numeric_limits<float>::quiet_NaN();  // shown as black
  EXPECT_NEAR(psnr(a, b), -10 * std::log10(0.5), 1e-6);
}

TEST(Psnr, MaskedPixelsDoNotCount) {
  ImageF a(4, 4, 3, 0.25f), b(4, 4, 3, 0.5f);
  ImageU8 mask(4, 4, 1, 255);
  for (int c = 0; c < 3; ++c) b(1, 2, c) = 1.0f;
  mask(1, 2) = 0;
  EXPECT_NEAR(psnr(a, b, mask), -20 * std::log10(0.25), 1e-9);
  EXPECT_LT(psnr(a, b), -20 * std::log10(0.25));
}

TEST(Ssim, AgreesWithScikitImage) {
  EXPECT_NEAR(ssim(formula_image(false), formula_image(true)), 0.9439073848621368, 1e-6);
}

TEST(Ssim, AgreesWithTheDefinition) {
  const ImageF a = formula_image(false);
  for (const double sigma : {0.001, 0.05, 0.5}) {
    const ImageF b = noisy(a, sigma, 3);
    EXPECT_NEAR(ssim(a, b), slow_ssim(a, b), 2e-6) << sigma;
  }
  const ImageF dark(20, 20, 1, 0.02f), darker = noisy(ImageF(20, 20, 1, 0.01f), 0.002, 4);
  EXPECT_NEAR(ssim(dark, darker), slow_ssim(dark, darker), 2e-6);
}

TEST(Ssim, OfEqualImagesIsOne) {
  EXPECT_NEAR(ssim(formula_image(true), formula_image(true)), 1.0, 1e-6);
  const ImageF smallest(11, 11, 1, 0.3f);
  EXPECT_NEAR(ssim(smallest, smallest), 1.0, 1e-6);
}

TEST(Ssim, CountsWindowsWithoutMaskedPixelsOnly) {
  const ImageF a = formula_image(false);
  ImageF b = noisy(a, 0.05, 5);
  ImageU8 mask(a.width(), a.height(), 1, 1);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 20 - y; ++x) {
      mask(x, y) = 0;
      b(x, y, 1) = 0;
    }
  }
  mask(40, 30) = 0;
  EXPECT_NEAR(ssim(a, b, mask), slow_ssim(a, b, mask), 2e-6);
}

TEST(Ssim, WithoutAnyWindowIsNotANumber) {
  const ImageF a(12, 12, 1, 0.5f);
  ImageU8 mask(12, 12, 1, 1);
  mask(6, 6) = 0;
  EXPECT_TRUE(std::isnan(ssim(a, a, mask)));
}

TEST(Metrics, RejectImagesThatDoNotFit) {
  EXPECT_THROW(psnr(ImageF(4, 4, 3), ImageF(4, 4, 1)), CheckError);
  EXPECT_THROW(psnr(ImageF(4, 4), ImageF(4, 4), ImageU8(4, 4)), CheckError) << "nothing selected";
  EXPECT_THROW(ssim(ImageF(10, 20), ImageF(10, 20)), CheckError);
}

}  // namespace
}  // namespace photoslam
