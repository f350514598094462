// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/target_image.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/random.h"
#include "image/pyramid.h"

namespace photoslam::splatting {
namespace {

CameraView random_view(int width, int height) {
  Random random(1);
  CameraView view{.camera = {width, height, 50, 50, 20, 15},
                  .color = ImageU8(width, height, 3),
                  .depth = ImageU16(width, height),
                  .mask = ImageU8(width, height)};
  for (uint8_t& value : view.color.values()) value = static_cast<uint8_t>(random.index(256));
  for (uint16_t& value : view.depth.values()) value = static_cast<uint16_t>(random.index(3) * random.index(9000));
  for (uint8_t& value : view.mask.values()) value = random.uniform() < 0.97 ? 1 : 0;
  return view;
}

TargetImage make_target(const CameraView& view) {
  TargetImage target(view.camera.width, view.camera.height, view.color.values(), view.mask.values());
  if (!view.depth.empty()) target.set_depth(view.depth.values(), 1e-3f);
  return target;
}

TEST(TargetImage, IsShrunkAsViewsAre) {
  const CameraView full = random_view(67, 41);
  const TargetImage target = make_target(full);
  for (const int factor : {1, 2, 3, 4, 8}) {
    const TargetImage want = make_target(shrink(full, factor));
    const TargetImage& got = target.shrunk(factor, true);
    EXPECT_EQ(got.width(), want.width());
    EXPECT_EQ(got.height(), want.height());
    EXPECT_TRUE(std::ranges::equal(got.planes(), want.planes())) << factor;
    EXPECT_TRUE(std::ranges::equal(got.depth(), want.depth())) << factor;
    EXPECT_EQ(got.num_valid(), want.num_valid()) << factor;
    EXPECT_EQ(got.num_depth(), want.num_depth()) << factor;
    for (size_t i = 0; i < want.mask().size(); ++i) ASSERT_EQ(got.mask()[i] != 0, want.mask()[i] != 0) << factor;
  }
}

TEST(TargetImage, IsShrunkOnceAndItsDepthWhenThatIsAskedFor) {
  TargetImage target = make_target(random_view(20, 16));
  const TargetImage& small = target.shrunk(2, false);
  EXPECT_FALSE(small.has_depth());
  EXPECT_EQ(&target.shrunk(2, true), &small);
  EXPECT_TRUE(small.has_depth());
  const std::vector<uint16_t> depth(20 * 16, 700);
  target.set_depth(depth, 1e-3f);
  for (const uint16_t value : target.shrunk(2, true).depth()) EXPECT_TRUE(value == 0 || value == 700);
}

}  // namespace
}  // namespace photoslam::splatting
