// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// The engine against the double-precision oracle, on every SIMD target.
#include <gtest/gtest.h>

#include <cmath>

#include "splatting/renderer.h"
#include "splatting/testing/scenes.h"
#include "splatting/testing/simd_targets.h"
#include "splatting/trainer.h"

namespace photoslam::splatting {
namespace {

using testing::Scene;

struct Group {
  const char* name;
  int begin, end;
};
constexpr Group kGroups[] = {{"mean", 0, 3},      {"rotation", 3, 7}, {"log_scale", 7, 10},
                             {"opacity", 10, 11}, {"sh_dc", 11, 14},  {"sh_rest", 14, 59}};

/// Relative L2 distance; zero against zero is zero.
double relative_error(const std::vector<double>& got, const std::vector<double>& want) {
  double difference = 0, norm = 0;
  for (size_t i = 0; i < got.size(); ++i) {
    difference += (got[i] - want[i]) * (got[i] - want[i]);
    norm += want[i] * want[i];
  }
  return norm > 0 ? std::sqrt(difference / norm) : std::sqrt(difference);
}

class Engine : public ::testing::TestWithParam<int64_t> {
 protected:
  testing::ScopedSimdTarget simd_target{GetParam()};
  SerialExecutor executor;
};

INSTANTIATE_TEST_SUITE_P(Simd, Engine, ::testing::ValuesIn(testing::simd_targets()),
                         [](const auto& p) { return testing::simd_target_name(p.param); });

TEST_P(Engine, ImagesEqualTheOracle) {
  for (Scene& scene : testing::hard_scenes()) {
    scene.build(11);
    const reference::Image want = reference::render(scene.reference_gaussians, scene.reference_view, scene.noise);
    Renderer renderer;
    RenderResult got;
    renderer.render(scene.model, scene.view, scene.options, executor, got);
    ASSERT_EQ(got.width, scene.width);
    ASSERT_EQ(got.height, scene.height);
    double worst = 0, ambiguous = 0, covered = 0;
    for (size_t i = 0; i < scene.plane(); ++i) {
      covered += want.alpha[i] / static_cast<double>(scene.plane());
      ambiguous += want.ambiguous[i] / static_cast<double>(scene.plane());
      if (want.ambiguous[i]) continue;
      for (size_t k = 0; k < 3; ++k)
        worst = std::max(worst, std::abs(got.rgb[k * scene.plane() + i] - want.rgb[k * scene.plane() + i]));
      worst = std::max(worst, std::abs(got.alpha[i] - want.alpha[i]));
      worst = std::max(worst, std::abs(got.depth[i] - want.depth[i]) / scene.depth_max);
    }
    std::printf("  %-16s max error %.1e, ambiguous %.2f %%, mean alpha %.2f\n", scene.name.c_str(), worst,
                100 * ambiguous, covered);
    EXPECT_LE(worst, scene.image_tolerance) << scene.name;
    EXPECT_LE(ambiguous, scene.max_ambiguous) << scene.name;
    EXPECT_GT(covered, 0.003) << scene.name << " shows nothing";
  }
}

TEST_P(Engine, GradientsEqualTheOracle) {
  for (Scene& scene : testing::hard_scenes()) {
    scene.build(12);
    const reference::Image image = reference::render(scene.reference_gaussians, scene.reference_view, scene.noise);
    Random random(13);
    std::vector<double> dl_drgb(3 * scene.plane()), dl_ddepth(scene.plane()), dl_dalpha(scene.plane());
    for (size_t i = 0; i < scene.plane(); ++i) {
      const double keep = image.ambiguous[i] ? 0 : 1;
      for (size_t k = 0; k < 3; ++k) dl_drgb[k * scene.plane() + i] = static_cast<float>(keep * random.normal());
      dl_ddepth[i] = static_cast<float>(keep * 0.3 * random.normal());
      dl_dalpha[i] = static_cast<float>(keep * 0.3 * random.normal());
    }
    const reference::Gradients want =
        reference::backward(scene.reference_gaussians, scene.reference_view, dl_drgb, dl_ddepth, dl_dalpha);
    Trainer trainer;
    Gradients got;
    const auto floats = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
    trainer.forward(scene.model, scene.view, scene.options, executor);
    trainer.backward(scene.model, floats(dl_drgb), floats(dl_ddepth), floats(dl_dalpha), executor, got);

    for (const Group& group : kGroups) {
      std::vector<double> a, b;
      for (size_t i = 0; i < scene.indices.size(); ++i)
        for (int k = group.begin; k < group.end; ++k) {
          a.push_back(static_cast<double>(got.at(scene.indices[i], k)));
          b.push_back(want.parameters[i][static_cast<size_t>(k)]);
        }
      EXPECT_LE(relative_error(a, b), scene.gradient_tolerance) << scene.name << " " << group.name;
    }
    const std::vector<double> pose(got.pose, got.pose + 6);
    EXPECT_LE(relative_error(pose, {want.pose.begin(), want.pose.end()}), scene.gradient_tolerance) << scene.name;
  }
}

TEST_P(Engine, OneSplatHasTheClosedForm) {
  // On the optical axis, isotropic: alpha = o exp(−r² / (2 (σ² f²/z² + 0.3))), colour from the constant coefficient.
  GaussianModel model;
  model.add_anchor();
  Gaussian g;
  g.mean[2] = 2;
  for (float& s : g.log_scale) s = std::log(0.1f);
  g.opacity_logit = 0.4f;
  g.sh[0][0] = 1.0f;
  model.add(0, {&g, 1});
  const std::vector<Pose> poses(1);
  const View view{{41, 37, 50, 50, 20, 18}, poses};
  Renderer renderer;
  RenderResult image;
  renderer.render(model, view, {.near = 0.01f, .background = {0, 0, 1}, .sh_degree = 3}, executor, image);
  EXPECT_EQ(image.visible, 1);
  const double opacity = 1 / (1 + std::exp(-0.4)), variance = std::pow(0.1 * 50 / 2, 2) + 0.3;
  for (int y = 0; y < 37; ++y)
    for (int x = 0; x < 41; ++x) {
      const double r2 = (x - 20) * (x - 20) + (y - 18) * (y - 18);
      double alpha = opacity * std::exp(-r2 / (2 * variance));
      if (alpha < 1.0 / 255) alpha = 0;
      const size_t at = static_cast<size_t>(y * 41 + x), plane = 41 * 37;
      ASSERT_NEAR(image.alpha[at], alpha, 1e-6) << x << " " << y;
      ASSERT_NEAR(image.depth[at], 2 * alpha, 2e-6);
      ASSERT_NEAR(image.rgb[at], alpha * (0.5 + 0.28209479177387814), 1e-6);
      ASSERT_NEAR(image.rgb[2 * plane + at], alpha * 0.5 + (1 - alpha), 1e-6);
    }
}

TEST_P(Engine, AShrunkPictureIsTheMeanOfItsPixels) {
  GaussianModel model;
  model.add_anchor();
  Gaussian g;
  g.mean[2] = 1;
  const float sigma_px[] = {0.8f, 1.5f, 4.0f};
  for (int i = 0; i < 3; ++i) g.log_scale[i] = std::log(sigma_px[i] / 50);
  g.rotation[3] = 0.4f;
  g.opacity_logit = 3;
  model.add(0, {&g, 1});
  const std::vector<Pose> poses(1);
  Renderer renderer;
  RenderResult full, shrunk;
  renderer.render(model, {{48, 48, 50, 50, 20, 21}, poses}, {}, executor, full);
  for (const int factor : {2, 4}) {
    const auto f = static_cast<float>(factor);
    const Camera camera{48 / factor, 48 / factor, 50 / f, 50 / f, 20.5f / f - 0.5f, 21.5f / f - 0.5f};
    renderer.render(model, {camera, poses}, {.shrink_factor = factor}, executor, shrunk);
    double worst = 0, highest = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        double mean = 0;
        for (int i = 0; i < factor * factor; ++i)
          mean += full.alpha[static_cast<size_t>((factor * y + i / factor) * 48 + factor * x + i % factor)] / f / f;
        highest = std::max(highest, mean);
        worst = std::max(worst, std::abs(mean - shrunk.alpha[static_cast<size_t>(y * camera.width + x)]));
      }
    EXPECT_GT(highest, 0.3);
    EXPECT_LE(worst, 0.06 * highest) << factor;  // a square is not a gaussian
  }
}

TEST_P(Engine, NearSplatsHideFarOnesUntilTransmittanceIsSpent) {
  GaussianModel model;
  model.add_anchor();
  for (int i = 0; i < 4; ++i) {
    Gaussian g;
    for (float& s : g.log_scale) s = 3;
    g.opacity_logit = std::log(0.95f / 0.05f);
    g.mean[2] = static_cast<float>(4 - i);
    model.add(0, {&g, 1});
  }
  const std::vector<Pose> poses(1);
  Renderer renderer;
  RenderResult image;
  renderer.render(model, {{1, 1, 10, 10, 0, 0}, poses}, {}, executor, image);
  // Transmittance 0.05, 0.0025, 1.25e-4; the fourth would leave 6e-6 <= 1e-4: blending stops before it.
  EXPECT_NEAR(image.alpha[0], 1 - 1.25e-4, 1e-6);
  EXPECT_NEAR(image.depth[0], 0.95 * (1 + 0.05 * 2 + 0.0025 * 3), 1e-6);
}

}  // namespace
}  // namespace photoslam::splatting
