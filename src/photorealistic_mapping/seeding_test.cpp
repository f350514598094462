// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/seeding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "math/se3.h"

namespace photoslam {
namespace {

constexpr int kCell = 4;

/// A view of the plane z = depth + slope x, of one colour, before an empty map.
struct Scene {
  DepthPicture view;
  splatting::RenderResult render;

  explicit Scene(double depth, double slope = 0) {
    view.camera = {64, 48, 60, 60, 31, 25};
    view.color = ImageU8(64, 48, 3, 0);
    view.depth = ImageF(64, 48);
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        view.color(x, y, 0) = 51;
        view.color(x, y, 1) = 102;
        view.color(x, y, 2) = 204;
        // z = depth + slope * X with X = (x - cx) / fx * z
        const double z = depth / (1.0 - slope * (x - view.camera.cx) / view.camera.fx);
        view.depth(x, y) = static_cast<float>(z);
      }
    }
    render.width = 64;
    render.height = 48;
    render.rgb.assign(64 * 48 * 3, 0.0f);
    render.depth.assign(64 * 48, 0.0f);
    render.alpha.assign(64 * 48, 0.0f);
  }

  void render_exactly() {
    for (size_t i = 0; i < 64 * 48; ++i) {
      render.alpha[i] = 1;
      render.depth[i] = view.depth.values()[i];
      for (size_t c = 0; c < 3; ++c)
        render.rgb[c * 64 * 48 + i] = static_cast<float>(view.color.values()[3 * i + c]) / 255;
    }
  }
};

Mat3 axes_of(const splatting::Gaussian& g) {
  return Quat(static_cast<double>(g.rotation[0]), static_cast<double>(g.rotation[1]),
              static_cast<double>(g.rotation[2]), static_cast<double>(g.rotation[3]))
      .toRotationMatrix();
}

TEST(SeedCells, OneDiscPerCellOnTheMeasuredSurface) {
  const SeedingOptions options;
  Scene scene(2.0);
  const auto seeds = seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error}).measured;
  ASSERT_EQ(seeds.size(), 16u * 12u);
  for (const auto& g : seeds) {
    EXPECT_NEAR(g.mean[2], 2.0, 1e-6);
    EXPECT_NEAR(std::exp(g.log_scale[1]), options.sigma_cells * kCell * 2.0 / 60, 1e-5);
    EXPECT_NEAR(std::abs(axes_of(g)(2, 2)), 1.0, 1e-5) << "the thin axis is the normal of the plane";
    EXPECT_NEAR(1 / (1 + std::exp(-g.opacity_logit)), options.opacity, 1e-5);
    const double expected[3] = {0.2, 0.4, 0.8};
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(0.5 + 0.28209479 * g.sh[0][c], expected[c], 1e-5);
  }
}

TEST(SeedCells, NothingIsSeededWhereThereIsNoData) {
  const SeedingOptions options;
  Scene scene(2.0);
  scene.view.mask = ImageU8(64, 48, 1, 255);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 18; ++x) {  // four columns of cells, and half of the fifth
      scene.view.mask(x, y) = 0;
      scene.view.depth(x, y) = 0;
      for (int c = 0; c < 3; ++c) scene.view.color(x, y, c) = 0;
    }
  }
  const auto seeds = seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error}).measured;
  ASSERT_EQ(seeds.size(), 12u * 12u);
  const double expected[3] = {0.2, 0.4, 0.8};
  for (const auto& g : seeds) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(0.5 + 0.28209479 * g.sh[0][c], expected[c], 1e-5) << "no black mixed in";
  }
  const DepthPixel features[] = {{10, 24, 2.0f, false}, {90, 24, 2.0f, false}};  // pixels of the full image
  EXPECT_EQ(seed_features(options, scene.view, 2, scene.render, features).size(), 1u);
}

TEST(SeedCells, TiltedSurfacesGetDiscsAlongThem) {
  const SeedingOptions options;
  const double slope = 0.4;
  Scene scene(2.0, slope);
  const auto seeds = seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error}).measured;
  const Vec3 normal = Vec3(-slope, 0, 1).normalized();
  int checked = 0;
  for (const auto& g : seeds) {
    const Vec3 mean(static_cast<double>(g.mean[0]), static_cast<double>(g.mean[1]), static_cast<double>(g.mean[2]));
    EXPECT_NEAR(mean.z(), 2.0 + slope * mean.x(), 0.02) << "on the plane, to the size of a cell";
    EXPECT_GT(std::abs(axes_of(g).col(2).dot(normal)), 0.99);
    EXPECT_GT(g.log_scale[0], g.log_scale[1]) << "stretched along the slope";
    ++checked;
  }
  EXPECT_GT(checked, 100);
}

TEST(SeedCells, WhatTheMapExplainsIsNotSeeded) {
  const SeedingOptions options;
  Scene scene(2.0);
  scene.render_exactly();
  EXPECT_TRUE(seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error}).measured.empty());
  // A block of another colour; and one that is measured before the surface that is drawn, but looks like it.
  for (int y = 8; y < 12; ++y) {
    for (int x = 8; x < 12; ++x) {
      for (int c = 0; c < 3; ++c) scene.view.color(x, y, c) = 255;
      scene.view.depth(x + 16, y) = 1.5f;
    }
  }
  const auto seeds = seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error}).measured;
  ASSERT_EQ(seeds.size(), 1u);
  EXPECT_NEAR(seeds[0].mean[2], 2.0, 1e-6);
}

TEST(SeedCells, WhatTwoPicturesSawBeforeWhatIsDrawnIsSeeded) {
  const SeedingOptions options;
  Scene scene(2.0);
  scene.render_exactly();
  // Three blocks before the surface that is drawn, that look like it: the first is confirmed, the second in a quarter
  // of its pixels, the third not far enough from it.
  ImageF confirmed(64, 48);
  for (int y = 8; y < 12; ++y) {
    for (int x = 8; x < 12; ++x) {
      confirmed(x, y) = scene.view.depth(x, y) = 1.5f;
      scene.view.depth(x + 16, y) = 1.5f;
      if (y == 8) confirmed(x + 16, y) = 1.5f;
      confirmed(x + 32, y) = scene.view.depth(x + 32, y) = 1.9f;
    }
  }
  // A cell with an edge, drawn as it is: its mean depth is neither.
  for (int y = 8; y < 12; ++y) {
    for (int x = 56; x < 60; ++x) {
      const float depth = x < 59 ? 1.0f : 6.0f;
      confirmed(x, y) = scene.view.depth(x, y) = depth;
      scene.render.depth[static_cast<size_t>(64 * y + x)] = depth;
    }
  }
  const SeedingRound round{kCell, options.min_color_error, false, confirmed};
  const auto seeds = seed_cells(options, scene.view, scene.render, round).measured;
  ASSERT_EQ(seeds.size(), 1u);
  EXPECT_NEAR(seeds[0].mean[2], 1.5, 1e-6);
  EXPECT_NEAR(seeds[0].mean[0], (9.5 - 31) / 60 * 1.5, 1e-6);
}

TEST(UnexplainedShare, CountsCellsWithDataThatLookWrong) {
  const SeedingOptions options;
  Scene scene(2.0);
  EXPECT_EQ(unexplained_share(options, scene.view, scene.render, kCell), 1.0) << "an empty map explains nothing";
  scene.render_exactly();
  EXPECT_EQ(unexplained_share(options, scene.view, scene.render, kCell), 0.0);
  for (size_t i = 0; i < 64 * 12; ++i) scene.render.alpha[i] = 0;  // a quarter
  EXPECT_DOUBLE_EQ(unexplained_share(options, scene.view, scene.render, kCell), 0.25);
  for (int y = 24; y < 36; ++y) {  // and another, in another colour
    for (int x = 0; x < 64; ++x) scene.view.color(x, y, 0) = 255;
  }
  EXPECT_DOUBLE_EQ(unexplained_share(options, scene.view, scene.render, kCell), 0.5);
  scene.view.mask = ImageU8(64, 48, 1, 255);
  std::fill_n(scene.view.mask.values().begin(), 64 * 12, uint8_t{0});
  EXPECT_NEAR(unexplained_share(options, scene.view, scene.render, kCell), 1.0 / 3, 1e-12);
}

TEST(SeedCells, HolesTakeTheNearestDepthOnlyWhereNothingIsDrawn) {
  const SeedingOptions options;
  Scene scene(2.0);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 32; ++x) scene.view.depth(x, y) = 0;
  }
  const auto [measured, guessed] = seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error});
  EXPECT_EQ(measured.size(), 8u * 12u);
  EXPECT_EQ(guessed.size(), 8u * 12u);
  scene.render_exactly();
  std::ranges::fill(scene.render.rgb, 0.0f);  // wrong colour everywhere
  const CellSeeds covered = seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error});
  EXPECT_EQ(covered.measured.size(), 8u * 12u);
  EXPECT_TRUE(covered.guessed.empty());
}

TEST(SeedCells, HolesOfAPictureWithoutDepthTakeWhatIsDrawnAround) {
  const SeedingOptions options;
  Scene scene(2.0);
  scene.render_exactly();
  scene.view.depth = {};
  for (int y = 16; y < 24; ++y) {  // four cells are open, of which a trace is drawn somewhere else
    for (int x = 20; x < 28; ++x) {
      scene.render.alpha[static_cast<size_t>(y * 64 + x)] = 0.1f;
      scene.render.depth[static_cast<size_t>(y * 64 + x)] = 0.1f * 7;
    }
  }
  std::fill_n(scene.render.rgb.begin(), 64 * 8, 0.0f);  // another colour is no hole
  EXPECT_TRUE(seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error}).guessed.empty());
  const auto seeds = seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error, true}).guessed;
  ASSERT_EQ(seeds.size(), 4u);
  for (const auto& g : seeds) EXPECT_NEAR(g.mean[2], 2, 1e-5);
}

TEST(SeedCells, AHoleBetweenNearAndFarIsFar) {
  Scene scene(2.0);
  // A tree, columns of cells 0 to 5; behind it a wall from column 8 on, and between them the sky.
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) scene.view.depth(x, y) = x < 6 * kCell ? 1.0f : x < 9 * kCell ? 0.0f : 5.0f;
  }
  std::map<int, float> depth_of_column;
  const auto [measured, guessed] = seed_cells({}, scene.view, scene.render, {kCell, 0.1});
  EXPECT_EQ(measured.size(), (6u + 7u) * 12u);
  for (const auto& g : guessed) {
    const double x = static_cast<double>(g.mean[0] / g.mean[2]) * scene.view.camera.fx + scene.view.camera.cx;
    depth_of_column[static_cast<int>(x) / kCell] = g.mean[2];
  }
  EXPECT_EQ(depth_of_column.size(), 3u);
  EXPECT_NEAR(depth_of_column[6], 1, 1e-5) << "the tree is nearer to it";
  EXPECT_NEAR(depth_of_column[7], 5, 1e-5) << "as near to either";
  EXPECT_NEAR(depth_of_column[8], 5, 1e-5);
}

TEST(SeedCells, WithoutAnyDepthThereIsNothingToSeed) {
  Scene scene(2.0);
  scene.view.depth = ImageF(64, 48);
  const auto [measured, guessed] = seed_cells({}, scene.view, scene.render, {kCell, 0.1});
  EXPECT_TRUE(measured.empty() && guessed.empty());
}

TEST(SeedFeatures, BothDensificationsCanBeSwitchedOff) {
  SeedingOptions options;
  options.dense = false;
  options.inactive_features = false;
  Scene scene(2.0);
  EXPECT_TRUE(seed_cells(options, scene.view, scene.render, {kCell, options.min_color_error}).measured.empty());
  const std::vector<DepthPixel> features = {{20.5f, 20.5f, 2.0f, true}, {80.5f, 60.5f, 2.0f, false}};
  EXPECT_EQ(seed_features(options, scene.view, 2, scene.render, features).size(), 1u) << "landmarks stay";
}

TEST(SeedFeatures, ADarkPixelBeforeAnEmptyMapIsNotExplained) {
  Scene scene(2.0);
  std::ranges::fill(scene.view.color.values(), uint8_t{0});
  const std::vector<DepthPixel> features = {{20.5f, 20.5f, 2.0f, true}};
  EXPECT_EQ(seed_features({}, scene.view, 2, scene.render, features).size(), 1u) << "an empty map renders black too";
}

TEST(SeedFeatures, OnlyPixelsThatLookWrongGetOne) {
  const SeedingOptions options;
  Scene scene(2.0);
  scene.render_exactly();
  const std::vector<DepthPixel> features = {
      {20.5f, 20.5f, 2.0f, true}, {80.5f, 60.5f, 2.0f, false}, {500.0f, 2.0f, 2.0f, true}};
  EXPECT_TRUE(seed_features(options, scene.view, 2, scene.render, features).empty());
  for (int c = 0; c < 3; ++c) scene.view.color(40, 30, c) = 255;  // where feature 1 lies in the half-size view
  const auto seeds = seed_features(options, scene.view, 2, scene.render, features);
  ASSERT_EQ(seeds.size(), 1u);
  const double x = (80.5 + 0.5) / 2 - 0.5;
  EXPECT_NEAR(seeds[0].mean[0], (x - 31) / 60 * 2.0, 1e-6);
  EXPECT_NEAR(std::exp(seeds[0].log_scale[1]), options.feature_sigma_px / 2 * 2.0 / 60, 1e-5);
}

}  // namespace
}  // namespace photoslam
