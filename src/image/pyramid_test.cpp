// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/pyramid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "image/convert.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {.width = 640, .height = 480, .fx = 525, .fy = 520, .cx = 317.3, .cy = 244.1};

/// Renders an anti-aliased edge: dark left of the column where the plane x = `edge` at z = 1 projects to, bright right.
ImageF render_edge(const PinholeCamera& camera, double edge) {
  const double column = camera.project(Vec3(edge, 0, 1)).x();
  ImageF image(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      image(x, y) = static_cast<float>(std::clamp(x + 0.5 - column, 0.0, 1.0));
    }
  }
  return image;
}

/// Sub-pixel column of a dark-to-bright edge in row y: where the row's dark part ends.
double find_edge(const ImageF& image, int y) {
  double dark = 0;
  for (int x = 0; x < image.width(); ++x) dark += 1 - image(x, y);
  return dark - 0.5;
}

TEST(Pyramid, AnEdgeStaysWhereTheCameraSaysItIs) {
  constexpr double kEdge = 0.1234;
  const ImageF full = render_edge(kCamera, kEdge);
  for (const int factor : {1, 2, 3, 4, 8}) {
    const PinholeCamera camera = shrink(kCamera, factor);
    const ImageF level = shrink_color(full, factor);
    ASSERT_EQ(level.width(), camera.width);
    ASSERT_EQ(level.height(), camera.height);
    EXPECT_NEAR(find_edge(level, level.height() / 2), camera.project(Vec3(kEdge, 0, 1)).x(), 1e-4) << factor;
    // … and where the camera of that level would see it itself.
    const ImageF direct = render_edge(camera, kEdge);
    for (int x = 0; x < camera.width; ++x) ASSERT_NEAR(level(x, 3), direct(x, 3), 1e-4) << factor << " " << x;
  }
}

TEST(Pyramid, EdgesOfEightBitViewsFollowToo) {
  CameraView view{.camera = kCamera, .color = to_u8(render_edge(kCamera, -0.2)), .depth = {}, .mask = {}};
  for (int level = 1; level <= 3; ++level) {
    view = shrink(view, 2);
    EXPECT_EQ(view.color.width(), view.camera.width);
    EXPECT_EQ(view.color.height(), view.camera.height);
    EXPECT_NEAR(find_edge(to_float(view.color), 5), view.camera.project(Vec3(-0.2, 0, 1)).x(), 0.01) << level;
    EXPECT_TRUE(view.depth.empty() && view.mask.empty());
  }
}

TEST(Pyramid, ColorIsTheRoundedBlockMean) {
  Random random(1);
  ImageU8 image(23, 17, 3);
  for (uint8_t& v : image.values()) v = static_cast<uint8_t>(random.next());
  for (const int factor : {2, 3, 5}) {
    const ImageU8 small = shrink_color(image, factor);
    ASSERT_EQ(small.width(), 23 / factor);
    ASSERT_EQ(small.height(), 17 / factor);
    for (int y = 0; y < small.height(); ++y) {
      for (int x = 0; x < small.width(); ++x) {
        double sum = 0;
        for (int i = 0; i < factor * factor; ++i) sum += image(x * factor + i % factor, y * factor + i / factor, 1);
        ASSERT_NEAR(small(x, y, 1), sum / (factor * factor), 0.5);
      }
    }
  }
}

TEST(Pyramid, DepthIsNeverInventedBetweenSurfaces) {
  ImageU16 depth(4, 4);
  const auto fill_block = [&](int bx, int by, std::initializer_list<uint16_t> values) {
    int i = 0;
    for (const uint16_t v : values) {
      depth(2 * bx + i % 2, 2 * by + i / 2) = v;
      ++i;
    }
  };
  fill_block(0, 0, {1000, 1010, 1020, 1030});
  fill_block(1, 0, {1000, 3000, 3000, 1000});  // across an edge: one of the two
  fill_block(0, 1, {0, 0, 0, 900});            // too few
  fill_block(1, 1, {0, 0, 900, 910});
  const ImageU16 small = shrink_depth(depth, 2);
  EXPECT_EQ(small(0, 0), 1010);
  EXPECT_EQ(small(1, 0), 1000);
  EXPECT_EQ(small(0, 1), 0);
  EXPECT_EQ(small(1, 1), 900);
  EXPECT_EQ(shrink_depth(depth, 1), depth);
}

TEST(Pyramid, ABlockHasDataWhenAllItsPixelsHave) {
  ImageU8 mask(5, 4, 1, 255);
  mask(3, 1) = 0;
  mask(4, 3) = 0;  // in the dropped column
  const ImageU8 small = shrink_mask(mask, 2);
  ASSERT_EQ(small.width(), 2);
  EXPECT_EQ(small(0, 0), 255);
  EXPECT_EQ(small(1, 0), 0);
  EXPECT_EQ(small(0, 1), 255);
  EXPECT_EQ(small(1, 1), 255);
}

}  // namespace
}  // namespace photoslam
