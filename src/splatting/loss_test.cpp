// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/loss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "splatting/testing/simd_targets.h"

namespace photoslam::splatting {
namespace {

struct Case {
  int width, height;
  std::vector<double> render;   // [3, H, W]
  std::vector<uint8_t> target;  // [H, W, 3]
  std::vector<uint8_t> mask;    // [H, W] or empty
  Exposure exposure;

  size_t plane() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

Case make_case(int width, int height, bool masked, uint64_t seed) {
  Random random(seed);
  Case c{width, height, {}, {}, {}, {}};
  for (size_t i = 0; i < 3 * c.plane(); ++i) {
    const double smooth = 0.5 + 0.4 * std::sin(0.1 * static_cast<double>(i % static_cast<size_t>(width)));
    c.target.push_back(static_cast<uint8_t>(255 * std::clamp(smooth + 0.1 * random.normal(), 0.0, 1.0)));
    // Floats, and never close to the target: the absolute value has a kink there.
    c.render.push_back(static_cast<float>(smooth + 0.02 * random.normal()));
  }
  for (size_t i = 0; masked && i < c.plane(); ++i) c.mask.push_back(random.uniform() < 0.8 ? 255 : 0);
  if (masked) c.exposure = {{1.1f, 0.9f, 1.05f}, {0.02f, -0.01f, 0.03f}};
  return c;
}

/// The definition, in double precision: (1 − λ) L1 + λ (1 − SSIM), windows by brute force.
double naive_loss(const Case& c, double lambda, const std::vector<double>& render, double* ssim_out = nullptr) {
  const int w = c.width, h = c.height;
  double weights[11], norm = 0;
  for (int k = 0; k < 11; ++k) norm += weights[k] = std::exp(-(k - 5) * (k - 5) / (2 * 1.5 * 1.5));
  for (double& weight : weights) weight /= norm;
  double l1 = 0, ssim = 0, count = 0;
  for (size_t ch = 0; ch < 3; ++ch) {
    const auto valid = [&](int x, int y) {
      return x >= 0 && x < w && y >= 0 && y < h && (c.mask.empty() || c.mask[static_cast<size_t>(y * w + x)] != 0);
    };
    const auto a = [&](int x, int y) {
      return valid(x, y)
                 ? static_cast<double>(c.exposure.gain[ch]) * render[ch * c.plane() + static_cast<size_t>(y * w + x)] +
                       static_cast<double>(c.exposure.bias[ch])
                 : 0.0;
    };
    const auto b = [&](int x, int y) {
      return valid(x, y) ? c.target[static_cast<size_t>(y * w + x) * 3 + ch] / 255.0 : 0.0;
    };
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        if (!valid(x, y)) continue;
        ++count;
        l1 += std::abs(a(x, y) - b(x, y));
        double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
        for (int j = -5; j <= 5; ++j)
          for (int i = -5; i <= 5; ++i) {
            const double k = weights[i + 5] * weights[j + 5], va = a(x + i, y + j), vb = b(x + i, y + j);
            ma += k * va;
            mb += k * vb;
            aa += k * va * va;
            bb += k * vb * vb;
            ab += k * va * vb;
          }
        const double c1 = 1e-4, c2 = 9e-4;
        ssim += (2 * ma * mb + c1) * (2 * (ab - ma * mb) + c2) /
                ((ma * ma + mb * mb + c1) * (aa - ma * ma + bb - mb * mb + c2));
      }
  }
  if (ssim_out != nullptr) *ssim_out = ssim / count;
  return (1 - lambda) * l1 / count + lambda * (1 - ssim / count);
}

class Loss : public ::testing::TestWithParam<int64_t> {
 protected:
  PhotometricLoss evaluate(const Case& c, float lambda, std::vector<float>& gradient) {
    const std::vector<float> render(c.render.begin(), c.render.end());
    LossFunction loss;
    SerialExecutor executor;
    return loss.evaluate(render, TargetImage(c.width, c.height, c.target, c.mask), lambda, c.exposure, executor,
                         gradient);
  }
  testing::ScopedSimdTarget target_{GetParam()};
};

INSTANTIATE_TEST_SUITE_P(Simd, Loss, ::testing::ValuesIn(testing::simd_targets()),
                         [](const auto& p) { return testing::simd_target_name(p.param); });

TEST_P(Loss, ValueEqualsTheDefinition) {
  for (const auto& [w, h] : {std::pair{37, 29}, {64, 120}, {1, 1}, {5, 3}, {16, 100}})
    for (const bool masked : {false, true}) {
      const Case c = make_case(w, h, masked && w > 5, 3);
      std::vector<float> gradient;
      double ssim = 0;
      const double want = naive_loss(c, 0.2, c.render, &ssim);
      const PhotometricLoss got = evaluate(c, 0.2f, gradient);
      EXPECT_NEAR(got.loss, want, 2e-6) << w << "x" << h;
      EXPECT_NEAR(got.ssim, ssim, 1e-5) << w << "x" << h;
      EXPECT_NEAR(evaluate(c, 0.0f, gradient).loss, naive_loss(c, 0, c.render), 1e-6);
    }
}

TEST_P(Loss, GradientAgreesWithFiniteDifferences) {
  for (const bool masked : {false, true})
    for (const double lambda : {0.0, 0.2, 1.0}) {
      const Case c = make_case(18, 103, masked, 7);
      std::vector<float> gradient;
      evaluate(c, static_cast<float>(lambda), gradient);
      ASSERT_EQ(gradient.size(), c.render.size());
      Random random(8);
      double difference = 0, norm = 0;
      for (int probe = 0; probe < 12; ++probe) {
        const size_t i = static_cast<size_t>(random.index(static_cast<int>(c.render.size())));
        std::vector<double> plus = c.render, minus = c.render;
        plus[i] += 1e-5;
        minus[i] -= 1e-5;
        const double numeric = (naive_loss(c, lambda, plus) - naive_loss(c, lambda, minus)) / 2e-5;
        difference += std::pow(numeric - static_cast<double>(gradient[i]), 2);
        norm += numeric * numeric;
      }
      EXPECT_LE(std::sqrt(difference / norm), 1e-4) << "lambda " << lambda << " masked " << masked;
    }
}

TEST_P(Loss, ExposureGradientAgreesWithFiniteDifferences) {
  const Case c = make_case(40, 30, true, 9);
  std::vector<float> gradient;
  const PhotometricLoss got = evaluate(c, 0.2f, gradient);
  for (size_t k = 0; k < 6; ++k) {
    const auto moved = [&](float step) {
      Case other = c;
      (k < 3 ? other.exposure.gain[k] : other.exposure.bias[k - 3]) += step;
      return naive_loss(other, 0.2, other.render);
    };
    const double numeric = (moved(1e-4f) - moved(-1e-4f)) / 2e-4;
    EXPECT_NEAR(static_cast<double>(got.exposure_gradient[k]), numeric, 2e-3 * std::abs(numeric) + 1e-4) << k;
  }
}

TEST_P(Loss, PixelsWithoutDataHaveNoGradient) {
  const Case c = make_case(40, 30, true, 10);
  std::vector<float> gradient;
  evaluate(c, 0.2f, gradient);
  for (size_t i = 0; i < c.render.size(); ++i) ASSERT_TRUE(c.mask[i % c.plane()] != 0 || gradient[i] == 0.0f) << i;
}

TEST(DepthLoss, ComparesWithTheDepthThatTheOpacityAllows) {
  // D = 1.5, A = 0.5, d = 2: residual 0.5; a pixel without depth does not count.
  TargetImage target(2, 1, std::vector<uint8_t>(6));
  target.set_depth(std::vector<uint16_t>{2000, 0}, 1e-3f);
  std::vector<float> by_depth, by_alpha;
  EXPECT_NEAR(depth_loss(std::vector<float>{1.5f, 9}, std::vector<float>{0.5f, 1}, target, 3, by_depth, by_alpha), 0.5,
              1e-6);
  EXPECT_EQ(by_depth, (std::vector<float>{3, 0}));
  EXPECT_EQ(by_alpha, (std::vector<float>{-6, -0.0f}));
}

TEST(TargetImage, KeepsDepthWithinHalfAStep) {
  TargetImage target(3, 1, std::vector<uint8_t>(9));
  target.set_depth(std::vector<float>{4.0f, -1.0f, 1.2345f});
  EXPECT_EQ(target.num_depth(), 2);
  EXPECT_EQ(target.depth()[1], 0);
  EXPECT_NEAR(static_cast<float>(target.depth()[2]) * target.depth_unit(), 1.2345, 0.51 * 4.0 / 65535);
}

}  // namespace
}  // namespace photoslam::splatting
