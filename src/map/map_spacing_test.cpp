// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/map_spacing.h"

#include <gtest/gtest.h>

#include "map/map.h"

namespace photoslam {
namespace {

TEST(MapSpacing, TheNextPlaceIsBeyondAllThatAreTaken) {
  Map map(1.2, 8);
  EXPECT_EQ(next_free_place(*map.snapshot()), 0);
  const auto add_keyframe_at = [&](double x) {
    map.add_keyframe(KeyframeId(static_cast<int32_t>(map.num_keyframes())), std::make_shared<FeatureFrame>(),
                     SE3(so3_exp(Vec3(0, 1, 0)), Vec3::Zero()) * SE3(Quat::Identity(), Vec3(-x, 0, 0)));
  };
  add_keyframe_at(-30);
  EXPECT_EQ(next_free_place(*map.snapshot()), 1);
  // The map between them has been joined with another: its place is free, but not the last.
  add_keyframe_at(2e4 + 400);
  EXPECT_EQ(next_free_place(*map.snapshot()), 3);
  add_keyframe_at(3e4 - 400);
  add_keyframe_at(400);
  EXPECT_EQ(next_free_place(*map.snapshot()), 4);
}

}  // namespace
}  // namespace photoslam
