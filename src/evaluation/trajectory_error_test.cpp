// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/trajectory_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "base/random.h"
#include "sources/ground_truth.h"

namespace photoslam {
namespace {

constexpr int64_t kFrameInterval = 100'000'000;  // 10 Hz, so that ten frames are exactly one second
constexpr double kDegree = std::numbers::pi / 180;

Trajectory random_walk(int count, uint64_t seed) {
  Random random(seed);
  Trajectory trajectory;
  SE3 pose;
  for (int i = 0; i < count; ++i) {
    Vec6 step;
    for (int k = 0; k < 6; ++k) step[k] = 0.1 * random.normal();
    pose = pose * SE3::exp(step);
    trajectory.push_back({i * kFrameInterval, pose});
  }
  return trajectory;
}

/// A round trip in the plane, looking ahead.
Trajectory circle(int count, double radius) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    trajectory.push_back(
        {i * kFrameInterval, SE3(so3_exp(Vec3(0, 0, angle)), radius * Vec3(std::cos(angle), std::sin(angle), 0))});
  }
  return trajectory;
}

TEST(AbsoluteError, OfTheSameMotionInAnotherWorldIsZero) {
  const Trajectory truth = random_walk(100, 1);
  const SE3 other_from_world(so3_exp(Vec3(0.3, -1.2, 2.0)), Vec3(5, -3, 8));
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) pose.world_from_camera = other_from_world * pose.world_from_camera;
  const AbsoluteError error = absolute_error(estimate, truth, false).value();
  EXPECT_EQ(error.matched, 100u);
  EXPECT_LT(error.rmse_m, 1e-9);
  EXPECT_LT(error.rot_rmse_deg, 1e-6);
  EXPECT_EQ(error.scale, 1);
  const Trajectory back = aligned(estimate, error.truth_from_estimate);
  EXPECT_LT((back[42].world_from_camera.inverse() * truth[42].world_from_camera).log().norm(), 1e-9);
}

TEST(AbsoluteError, FindsTheScaleOfAMonocularRun) {
  const Trajectory truth = random_walk(100, 2);
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) pose.world_from_camera.translation /= 2.5;
  const AbsoluteError with_scale = absolute_error(estimate, truth, true).value();
  EXPECT_NEAR(with_scale.scale, 2.5, 1e-9);
  EXPECT_LT(with_scale.rmse_m, 1e-9);
  EXPECT_GT(absolute_error(estimate, truth, false)->rmse_m, 0.01);
  EXPECT_LT(relative_error(estimate, truth, with_scale.scale)->trans_m, 1e-9);
}

TEST(AbsoluteError, OfAZigzagIsItsAmplitude) {
  // Up and down by 3 cm in turn: no alignment can reduce that, and every frame is off by the same amount.
  const Trajectory truth = circle(40, 2);
  Trajectory estimate = truth;
  for (size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].world_from_camera.translation.z() += i % 2 == 0 ? 0.03 : -0.03;
  }
  const AbsoluteError error = absolute_error(estimate, truth, false).value();
  EXPECT_NEAR(error.rmse_m, 0.03, 1e-12);
  EXPECT_NEAR(error.median_m, 0.03, 1e-12);
  EXPECT_NEAR(error.std_m, 0, 1e-12);
}

TEST(AbsoluteError, OfOneOutlierAmongMany) {
  // A single frame off by d moves the alignment by O(d / N) only.
  const Trajectory truth = circle(10000, 2);
  Trajectory estimate = truth;
  estimate[5000].world_from_camera.translation.z() += 1;
  const AbsoluteError error = absolute_error(estimate, truth, false).value();
  EXPECT_NEAR(error.rmse_m, 0.01, 1e-5);
  EXPECT_NEAR(error.std_m, 0.01, 1e-4);
  EXPECT_LT(error.median_m, 1e-3);
}

TEST(AbsoluteError, SeesTurnedCameras) {
  const Trajectory truth = random_walk(50, 3);
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) {
    pose.world_from_camera.rotation = pose.world_from_camera.rotation * so3_exp(Vec3(0, 2 * kDegree, 0));
  }
  const AbsoluteError error = absolute_error(estimate, truth, false).value();
  EXPECT_LT(error.rmse_m, 1e-9);
  EXPECT_NEAR(error.rot_rmse_deg, 2, 1e-6);
}

TEST(AbsoluteError, OfAStraightPathDoesNotTurnAboutIt) {
  // 50 m ahead, every position off by some 2 cm: by them alone the cameras would be turned about the path by anything.
  Random random(5);
  Trajectory truth, estimate;
  const SE3 other_from_world(so3_exp(Vec3(0.3, -1.2, 2.0)), Vec3(5, -3, 8));
  for (int i = 0; i < 100; ++i) {
    const SE3 pose(so3_exp(0.05 * Vec3(random.normal(), random.normal(), random.normal())), Vec3(0, 0, 0.5 * i));
    const Vec3 noise = 0.02 * Vec3(random.normal(), random.normal(), random.normal());
    truth.push_back({i * kFrameInterval, pose});
    estimate.push_back({i * kFrameInterval, other_from_world * SE3(pose.rotation, pose.translation + noise)});
  }
  const AbsoluteError error = absolute_error(estimate, truth, false).value();
  EXPECT_LT(error.rot_rmse_deg, 0.1);
  const Trajectory back = aligned(estimate, error.truth_from_estimate);
  EXPECT_LT((back[50].world_from_camera.translation - truth[50].world_from_camera.translation).norm(), 0.1);
  // A turn about the path that the cameras really made is still seen.
  for (size_t i = 0; i < estimate.size(); ++i) {
    Quat& rotation = estimate[i].world_from_camera.rotation;
    rotation = rotation * so3_exp(Vec3(0, 0, i % 2 == 0 ? 2 * kDegree : -2 * kDegree));
  }
  EXPECT_NEAR(absolute_error(estimate, truth, false)->rot_rmse_deg, 2, 0.1);
}

TEST(AbsoluteError, OfAPathThatIsNotStraightTurnsAboutIt) {
  // Ahead in waves as wide as 3 % of the way; every camera rolled by 2 degrees against its path.
  Trajectory truth, estimate;
  for (int i = 0; i < 100; ++i) {
    truth.push_back({i * kFrameInterval, SE3(Quat::Identity(), Vec3(0.6 * std::sin(0.3 * i), 0, 0.5 * i))});
    estimate.push_back(truth.back());
    estimate.back().world_from_camera.rotation = so3_exp(Vec3(0, 0, 2 * kDegree));
  }
  EXPECT_NEAR(absolute_error(estimate, truth, false)->rot_rmse_deg, 2, 1e-6);
}

TEST(AbsoluteError, ComparesOnlyPosesWithinTwentyMilliseconds) {
  const Trajectory truth = random_walk(30, 4);
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) pose.timestamp_ns += 20'000'000;
  EXPECT_EQ(absolute_error(estimate, truth, false)->matched, 30u);
  for (StampedPose& pose : estimate) pose.timestamp_ns += 1;
  EXPECT_FALSE(absolute_error(estimate, truth, false).has_value());
  EXPECT_FALSE(absolute_error({}, truth, false).has_value());
  EXPECT_FALSE(relative_error({}, truth).has_value());
}

TEST(RelativeError, OfASteadyDriftIsTheDriftPerSecond) {
  Trajectory truth, estimate;
  for (int i = 0; i < 50; ++i) {
    const double seconds = 0.1 * i;
    truth.push_back({i * kFrameInterval, SE3(Quat::Identity(), Vec3(0.5 * seconds, 0, 0))});
    // 4 % too far, and turning about the direction of travel by 3 degrees per second.
    estimate.push_back(
        {i * kFrameInterval, SE3(so3_exp(Vec3(3 * kDegree * seconds, 0, 0)), Vec3(0.52 * seconds, 0, 0))});
  }
  const RelativeError error = relative_error(estimate, truth).value();
  EXPECT_EQ(error.pairs, 40u);
  EXPECT_NEAR(error.trans_m, 0.02, 1e-12);
  EXPECT_NEAR(error.rot_deg, 3, 1e-9);
  EXPECT_NEAR(relative_error(estimate, truth, 1, 2)->trans_m, 0.04, 1e-12);
}

TEST(RelativeError, LeavesOutMotionsAcrossAGap) {
  const Trajectory truth = random_walk(40, 5);
  Trajectory estimate = truth;
  estimate.erase(estimate.begin() + 15, estimate.begin() + 25);
  const RelativeError error = relative_error(estimate, truth).value();
  // Starts 0…4 end in 10…14, starts 5…14 end in the gap, starts 25…29 end in 35…39.
  EXPECT_EQ(error.pairs, 10u);
  EXPECT_LT(error.trans_m, 1e-12);
  EXPECT_FALSE(relative_error(estimate, truth, 1, 100).has_value());
}

TEST(TrajectoryError, RealTruthAgainstItselfIsExact) {
  const char* data = std::getenv("PHOTOSLAM_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "PHOTOSLAM_DATA_DIR is not set";
  const Trajectory truth = read_ground_truth(std::filesystem::path(data) / "redkitchen-rgbd").value();
  const AbsoluteError error = absolute_error(truth, truth, false).value();
  EXPECT_EQ(error.matched, 500u);
  EXPECT_LT(error.rmse_m, 1e-9);
  EXPECT_EQ(relative_error(truth, truth)->pairs, 485u);
}

}  // namespace
}  // namespace photoslam
