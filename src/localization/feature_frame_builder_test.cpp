// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/feature_frame_builder.h"

#include <gtest/gtest.h>

#include <random>

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera{.width = 320, .height = 240, .fx = 260, .fy = 260, .cx = 159.5, .cy = 119.5};
constexpr double kMetresPerUnit = 1.0 / 5000;
constexpr int kEdge = 160;  // first column of what is farther away

/// Blocks of random grey: corners everywhere.
ImageU8 blocks() {
  std::mt19937 random(3);
  constexpr int kBlock = 10;
  ImageU8 coarse(kCamera.width / kBlock, kCamera.height / kBlock, 1), image(kCamera.width, kCamera.height, 1);
  for (int y = 0; y < coarse.height(); ++y) {
    for (int x = 0; x < coarse.width(); ++x) coarse(x, y) = static_cast<uint8_t>(random() % 256);
  }
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) image(x, y) = coarse(x / kBlock, y / kBlock);
  }
  return image;
}

/// A slanted floor from 4 m (top) to 2 m (bottom); from the edge on everything is `step` times as far.
double true_depth(double x, double y, double step) {
  return (4.0 - 2.0 * y / kCamera.height) * (x < kEdge ? 1.0 : step);
}

ImageU16 measured(double step, double noise) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  ImageU16 depth(kCamera.width, kCamera.height);
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const double z = true_depth(x, y, step);
      depth(x, y) = static_cast<uint16_t>((z + noise * z * z * normal(random)) / kMetresPerUnit);
    }
  }
  return depth;
}

std::shared_ptr<const FeatureFrame> build(const ImageU16& depth) {
  FeatureFrameBuilder builder({}, {}, {}, kCamera, {.metres_per_unit = kMetresPerUnit});
  return builder.build(FrameId(0), 0, blocks(), depth);
}

TEST(FeatureFrameBuilderTest, NoiseIsNoDepthEdge) {
  for (const double noise : {0.0, 0.003, 0.01, 0.02}) {
    const auto frame = build(measured(1.0, noise));
    size_t inside = 0, with_depth = 0;
    for (size_t i = 0; i < frame->size(); ++i) {
      const Vec2 p = frame->observations[i].pixel;
      if (p.x() < 2 || p.y() < 2 || p.x() > kCamera.width - 3 || p.y() > kCamera.height - 3) continue;
      ++inside;
      if (!frame->observations[i].has_depth()) continue;
      ++with_depth;
      const double z = true_depth(p.x(), p.y(), 1.0);
      EXPECT_NEAR(frame->depth[i], z, 5 * noise * z * z + 0.02);
    }
    ASSERT_GT(inside, 500u);
    EXPECT_GT(with_depth, 0.97 * static_cast<double>(inside)) << noise;
  }
}

TEST(FeatureFrameBuilderTest, KeypointsBesideADepthEdgeHaveNoDepth) {
  for (const double noise : {0.0, 0.003, 0.01}) {
    const auto frame = build(measured(1.5, noise));
    int beside = 0;
    for (size_t i = 0; i < frame->size(); ++i) {
      const auto x = std::lround(frame->observations[i].pixel.x());
      if (x != kEdge - 1 && x != kEdge) continue;
      ++beside;
      EXPECT_FALSE(frame->observations[i].has_depth()) << noise << ", row " << frame->observations[i].pixel.y();
    }
    EXPECT_GE(beside, 5);
  }
}

TEST(FeatureFrameBuilderTest, KeypointsBesideAHoleHaveNoDepth) {
  ImageU16 depth = measured(1.0, 0.02);
  for (int y = 0; y < depth.height(); ++y) depth(kEdge, y) = 0;
  const auto frame = build(depth);
  int beside = 0;
  for (size_t i = 0; i < frame->size(); ++i) {
    if (std::abs(std::lround(frame->observations[i].pixel.x()) - kEdge) > 1) continue;
    ++beside;
    EXPECT_FALSE(frame->observations[i].has_depth());
  }
  EXPECT_GE(beside, 5);
}

TEST(FeatureFrameBuilderTest, TheEndOfTheDataIsNoFeature) {
  // No data outside a circle, as undistortion leaves it; the blocks are cut there, which makes corners.
  const auto distance = [](double x, double y) { return std::hypot(x - 159.5, y - 119.5); };
  constexpr double kRadius = 110;
  ImageU8 image = blocks(), mask(kCamera.width, kCamera.height, 1, 255);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (distance(x, y) > kRadius) image(x, y) = mask(x, y) = 0;
    }
  }
  const auto farthest = [&](const ImageU8& known) {
    FeatureFrameBuilder builder({}, {}, {}, kCamera, {}, known);
    const auto frame = builder.build(FrameId(0), 0, image, {});
    EXPECT_GT(frame->size(), 300u);
    EXPECT_EQ(frame->features.descriptors.size(), frame->size());
    double most = 0;
    for (const Keypoint& k : frame->features.keypoints) most = std::max(most, distance(double{k.x}, double{k.y}));
    return most;
  };
  EXPECT_GT(farthest({}), kRadius - 4) << "without the mask there are corners at the border";
  EXPECT_LT(farthest(mask), kRadius - 13);
}

}  // namespace
}  // namespace photoslam
