// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/seams.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {320, 240, 280, 280, 159.5, 119.5};
constexpr double kDepth = 4;

/// Keyframes in a row, 0.5 m apart, that look at a wall 4 m away; each shares landmarks with those next to it.
struct Row {
  MapSnapshot map;
  std::vector<Sim3> before;

  explicit Row(int count) {
    for (int i = 0; i < count; ++i) {
      auto view = std::make_shared<KeyframeView>();
      view->keyframe.id = KeyframeId(i);
      view->keyframe.camera_from_world.translation.x() = -0.5 * i;
      view->median_depth = kDepth;
      if (i > 0) view->covisible.push_back({KeyframeId(i - 1), 50});
      if (i + 1 < count) view->covisible.push_back({KeyframeId(i + 1), 50});
      map.keyframes.push_back(view);
      before.push_back(anchor_from_world(view->keyframe.camera_from_world, 1.0));
    }
  }

  void move(int keyframe, const Sim3& new_world_from_old_world) {
    auto& view = map.keyframes[static_cast<size_t>(keyframe)];
    KeyframeView moved = *view;
    moved.keyframe.camera_from_world =
        (Sim3(moved.keyframe.camera_from_world) * new_world_from_old_world.inverse()).rigid();
    moved.keyframe.scale *= new_world_from_old_world.scale;
    moved.median_depth *= new_world_from_old_world.scale;
    view = std::make_shared<const KeyframeView>(moved);
  }
  std::vector<int> seams(double min_shift_px) const { return find_seams(min_shift_px, kCamera, map, before); }
};

Sim3 sideways(double metres) { return {1, Quat::Identity(), Vec3(metres, 0, 0)}; }

TEST(Seams, LieWhereNeighboursMovedApart) {
  Row row(6);
  for (int i = 3; i < 6; ++i) row.move(i, sideways(0.05));
  const double shift_px = 0.05 * kCamera.fx / kDepth;
  EXPECT_EQ(row.seams(0.99 * shift_px), (std::vector{2, 3}));
  EXPECT_TRUE(row.seams(1.01 * shift_px).empty());
}

TEST(Seams, AreNotWhereEverythingMovedTogether) {
  Row row(4);
  const Sim3 move(1.7, so3_exp(Vec3(0.3, -1, 0.5)), Vec3(5, -2, 8));
  for (int i = 0; i < 4; ++i) row.move(i, move);
  EXPECT_TRUE(row.seams(1e-6).empty());
}

TEST(Seams, ComeOfAScaleThatChanged) {
  Row row(4);
  // About the centre of keyframe 3: what it saw grows, but not as it sees it itself.
  const Vec3 center(1.5, 0, 0);
  row.move(3, Sim3(1.1, Quat::Identity(), -0.1 * center));
  EXPECT_EQ(row.seams(1), std::vector{2});
}

TEST(Seams, OnlyKeyframesKnownBeforeCount) {
  Row row(4);
  row.before.pop_back();
  row.move(3, sideways(1));
  EXPECT_TRUE(row.seams(1).empty());
}

}  // namespace
}  // namespace photoslam
