// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/pending_keyframes.h"

#include <gtest/gtest.h>

#include <map>

#include "map/map.h"

namespace photoslam {
namespace {

SE3 at(double x, double turn = 0) { return SE3(so3_exp(Vec3(0, turn, 0)), Vec3(-x, 0, 0)); }

/// One keyframe is in the map, two more are on their way: each refers to the one before.
class PendingKeyframesTest : public ::testing::Test {
 protected:
  PendingKeyframesTest() {
    map.add_keyframe(KeyframeId(0), std::make_shared<FeatureFrame>(), at(1, 0.1));
    const auto frame = std::make_shared<FeatureFrame>();
    for (int32_t i = 1; i <= 2; ++i) {
      pending.add(KeyframeId(i), frame, KeyframeId(i - 1), step, pending.scale(KeyframeId(i - 1), map.snapshot().get()),
                  {{7, Vec3(0.1, 0.2, 3)}, {4, Vec3(-0.1, 0, 2)}});
    }
  }
  Map map{1.2, 8};
  PendingKeyframes pending;
  const SE3 step = at(0.5, -0.2);
};

TEST_F(PendingKeyframesTest, FollowTheirReferences) {
  const auto seen = map.snapshot();
  const SE3 expected = step * step * at(1, 0.1);
  EXPECT_LT((pending.camera_from_world(KeyframeId(2), seen.get()) * expected.inverse()).log().norm(), 1e-12);
  EXPECT_EQ(pending.scale(KeyframeId(2), seen.get()), 1.0);
  EXPECT_EQ(pending.scale(KeyframeId(0), nullptr), 1.0);
}

TEST_F(PendingKeyframesTest, GrowAsTheyWillWhenTheyEnterTheMap) {
  constexpr double kGrowth = 1.5;
  const SE3 before = pending.camera_from_world(KeyframeId(2), map.snapshot().get());
  const auto point_before = pending.point({KeyframeId(2), 7}, map.snapshot().get());
  const Sim3 move(kGrowth, so3_exp(Vec3(0.3, 0, 0.1)), Vec3(1, -2, 0.5));
  map.apply({.new_world_from_old_world = {move}});
  const auto seen = map.snapshot();
  for (int32_t i = 0; i <= 2; ++i) EXPECT_DOUBLE_EQ(pending.scale(KeyframeId(i), seen.get()), kGrowth) << i;
  const SE3 expected = (Sim3(before) * move.inverse()).rigid();
  EXPECT_LT((pending.camera_from_world(KeyframeId(2), seen.get()) * expected.inverse()).log().norm(), 1e-12);
  const auto point = pending.point({KeyframeId(2), 7}, seen.get());
  ASSERT_TRUE(point_before && point);
  EXPECT_LT((*point - move * *point_before).norm(), 1e-12);

  // One that is proposed now is born in the new unit.
  pending.add(KeyframeId(3), std::make_shared<FeatureFrame>(), KeyframeId(2), step,
              pending.scale(KeyframeId(2), seen.get()), {});
  EXPECT_DOUBLE_EQ(pending.scale(KeyframeId(3), seen.get()), 1.0);
  const SE3 newest = pending.camera_from_world(KeyframeId(3), seen.get());
  EXPECT_LT((newest * (step * expected).inverse()).log().norm(), 1e-12);
}

TEST_F(PendingKeyframesTest, KnowTheirPointsByKeypoint) {
  const auto seen = map.snapshot();
  std::map<int, Vec3> points;
  pending.for_each_point(seen.get(), [&](const LandmarkObservation& o, const FeatureFrame&, const Vec3& point) {
    if (o.keyframe == KeyframeId(1)) points[o.keypoint] = point;
  });
  ASSERT_EQ(points.size(), 2u);
  for (const auto& [keypoint, point] : points) {
    const auto found = pending.point({KeyframeId(1), keypoint}, seen.get());
    ASSERT_TRUE(found.has_value()) << keypoint;
    EXPECT_EQ(*found, point);
  }
  EXPECT_FALSE(pending.point({KeyframeId(1), 5}, seen.get()));
  EXPECT_FALSE(pending.point({KeyframeId(0), 7}, seen.get())) << "it is in the map";
  EXPECT_FALSE(pending.point({}, seen.get()));
  map.add_keyframe(KeyframeId(1), std::make_shared<FeatureFrame>(), at(2));
  pending.update(*map.snapshot());
  EXPECT_FALSE(pending.point({KeyframeId(1), 7}, seen.get()));
}

}  // namespace
}  // namespace photoslam
