// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/keyframe_decision.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;
constexpr double kDepth = 2.0;

class KeyframeDecisionTest : public ::testing::Test {
 protected:
  KeyframeDecisionTest() : decision(options) { decision.inserted(0, SE3{}); }
  KeyframeDecisionOptions options;
  KeyframeDecision decision;
};

TEST_F(KeyframeDecisionTest, ACameraAtRestNeedsNoKeyframes) {
  for (int i = 1; i < 1000; ++i) EXPECT_FALSE(decision.should_insert(i * kSecond / 10, SE3{}, 300, kDepth));
}

TEST_F(KeyframeDecisionTest, TranslationRotationAndLostLandmarksTrigger) {
  const int64_t now = kSecond / 2;
  const SE3 small(Quat::Identity(), Vec3(0.9 * options.max_translation * kDepth, 0, 0));
  const SE3 moved(Quat::Identity(), Vec3(1.1 * options.max_translation * kDepth, 0, 0));
  const SE3 turned(so3_exp(Vec3(0, 1.1 * options.max_rotation_deg * M_PI / 180, 0)), Vec3::Zero());
  EXPECT_FALSE(decision.should_insert(now, small, 300, kDepth));
  EXPECT_TRUE(decision.should_insert(now, moved, 300, kDepth));
  EXPECT_TRUE(decision.should_insert(now, turned, 300, kDepth));
  EXPECT_TRUE(decision.should_insert(now, SE3{}, static_cast<int>(300 * options.min_tracked_ratio) - 1, kDepth));
}

TEST_F(KeyframeDecisionTest, TurningAndMovingAddUp) {
  const auto view = [&](double turned, double moved) {
    return SE3(so3_exp(Vec3(0, turned * options.max_rotation_deg * M_PI / 180, 0)),
               Vec3(0, moved * options.max_translation * kDepth, 0));
  };
  EXPECT_FALSE(decision.should_insert(kSecond / 2, view(0.45, 0.5), 300, kDepth));
  EXPECT_TRUE(decision.should_insert(kSecond / 2, view(0.55, 0.5), 300, kDepth));
}

TEST_F(KeyframeDecisionTest, KeepsTheShortestInterval) {
  const SE3 far(Quat::Identity(), Vec3(1, 0, 0));
  EXPECT_FALSE(decision.should_insert(static_cast<int64_t>(0.9 * options.min_interval_s * kSecond), far, 10, kDepth));
  EXPECT_TRUE(decision.should_insert(static_cast<int64_t>(1.1 * options.min_interval_s * kSecond), far, 10, kDepth));
}

TEST_F(KeyframeDecisionTest, SlowMotionGetsOneAfterTheLongestInterval) {
  const SE3 slow(Quat::Identity(), Vec3(0.3 * options.max_translation * kDepth, 0, 0));
  EXPECT_FALSE(decision.should_insert(static_cast<int64_t>(0.9 * options.max_interval_s * kSecond), slow, 300, kDepth));
  EXPECT_TRUE(decision.should_insert(static_cast<int64_t>(1.1 * options.max_interval_s * kSecond), slow, 300, kDepth));
}

}  // namespace
}  // namespace photoslam
