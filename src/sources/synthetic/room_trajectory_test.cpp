// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/room_trajectory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sources/synthetic/room.h"

namespace photoslam {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(RoomTrajectory, MovesLikeAHand) {
  for (uint64_t seed : {1, 2, 77}) {
    const RoomTrajectory trajectory(seed, 10);
    constexpr double kStep = 1.0 / 60;
    double distance = 0, turn = 0;
    SE3 before = trajectory.world_from_camera(0);
    Vec6 velocity_before = Vec6::Zero();
    for (int i = 1; i < 60 * 65; ++i) {
      const SE3 now = trajectory.world_from_camera(i * kStep);
      const Vec6 step = (before.inverse() * now).log();
      distance += step.head<3>().norm();
      turn += step.tail<3>().norm();
      ASSERT_LE(step.head<3>().norm() / kStep, 0.6) << i * kStep;
      ASSERT_LE(step.tail<3>().norm() / kStep, 50 * kDegree) << i * kStep;
      // Smooth: the velocity has no jumps.
      if (i > 1) {
        ASSERT_LE((step - velocity_before).norm() / kStep / kStep, 3.0) << i * kStep;
      }
      velocity_before = step;
      before = now;
    }
    EXPECT_GT(distance, 0.2 * 65);
    EXPECT_GT(turn, 10 * kDegree * 65);
  }
}

TEST(RoomTrajectory, LoopsClose) {
  const RoomTrajectory trajectory(1, 10);
  for (double end : {10.0, 30.0, 60.0}) {
    const Vec6 gap = (trajectory.world_from_camera(0).inverse() * trajectory.world_from_camera(end)).log();
    EXPECT_LT(gap.head<3>().norm(), 0.04) << end;
    EXPECT_LT(gap.tail<3>().norm(), 4 * kDegree) << end;
  }
}

TEST(RoomTrajectory, HoldsTheCameraUprightInsideTheRoom) {
  const RoomTrajectory trajectory(3, 10);
  for (double t = 0; t < 60; t += 0.1) {
    const SE3 pose = trajectory.world_from_camera(t);
    EXPECT_LT((pose.rotation * Vec3::UnitY()).z(), -0.8) << t;
    EXPECT_TRUE((pose.translation.array() > 0.5).all() &&
                (pose.translation.array() < SyntheticRoom::size().array() - 0.5).all())
        << t;
  }
}

TEST(RoomTrajectory, SlowLapsFollowTheSamePath) {
  const RoomTrajectory fast(5, 10), slow(5, 30);
  for (double t = 0; t < 10; t += 0.7) {
    EXPECT_LT((fast.world_from_camera(t).translation - slow.world_from_camera(3 * t).translation).norm(), 0.05) << t;
  }
}

}  // namespace
}  // namespace photoslam
