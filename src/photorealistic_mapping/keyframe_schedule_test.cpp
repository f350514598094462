// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/keyframe_schedule.h"

#include <gtest/gtest.h>

#include <map>

namespace photoslam {
namespace {

TEST(KeyframeSchedule, LevelsFallWithUseAsInEquationFive) {
  ScheduleOptions options;
  options.start_pixels = 160 * 120;
  options.uses_per_level = 3;
  options.online_pixels = 640 * 480;
  KeyframeSchedule schedule(options, 640, 480, 1);
  schedule.add_view();
  std::vector<int> levels;
  for (int i = 0; i < 8; ++i) levels.push_back(schedule.next(false).level);
  EXPECT_EQ(levels, (std::vector{2, 2, 2, 1, 1, 1, 0, 0}));
}

TEST(KeyframeSchedule, OnlineStopsAtItsLevelAndRefinementGoesOn) {
  ScheduleOptions options;
  options.online_pixels = 320 * 240;
  options.online_uses = 0;
  KeyframeSchedule schedule(options, 640, 480, 1);
  schedule.add_view();
  int finest_online = 3;
  for (int i = 0; i < 50; ++i) finest_online = std::min(finest_online, schedule.next(false).level);
  EXPECT_EQ(finest_online, 1);
  EXPECT_EQ(schedule.next(true).level, 0);
}

TEST(KeyframeSchedule, OnlineGoesOnToFinerLevelsAfterManyUses) {
  ScheduleOptions options;
  options.start_pixels = 160 * 120;
  options.uses_per_level = 2;
  options.online_pixels = 160 * 120;
  options.online_uses = 5;
  KeyframeSchedule schedule(options, 640, 480, 1);
  schedule.add_view();
  std::vector<int> levels;
  for (int i = 0; i < 13; ++i) levels.push_back(schedule.next(false).level);
  EXPECT_EQ(levels, (std::vector{2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 0, 0, 0}));
}

TEST(KeyframeSchedule, LevelsFollowTheSizeOfThePicture) {
  ScheduleOptions options;
  options.start_pixels = 160 * 120;
  options.online_pixels = 320 * 240;
  options.pyramid_levels = 3;
  const auto levels = [&](int width, int height) {
    const KeyframeSchedule schedule(options, width, height, 1);
    return std::pair(schedule.coarsest_level(), schedule.online_level());
  };
  EXPECT_EQ(levels(160, 120), std::pair(0, 0));
  EXPECT_EQ(levels(320, 240), std::pair(1, 0));
  EXPECT_EQ(levels(322, 240), std::pair(2, 1));
  EXPECT_EQ(levels(640, 480), std::pair(2, 1));
  EXPECT_EQ(levels(2560, 1920), std::pair(3, 3));  // there is no coarser one
  options.pyramid_levels = 0;
  EXPECT_EQ(levels(640, 480), std::pair(0, 0));
}

TEST(KeyframeSchedule, EveryViewComesOncePerRound) {
  KeyframeSchedule schedule({}, 640, 480, 3);
  for (int i = 0; i < 7; ++i) schedule.add_view();
  std::map<int, int> uses;
  for (int i = 0; i < 7 * 5; ++i) ++uses[schedule.next(true).view];
  for (int view = 0; view < 7; ++view) EXPECT_EQ(uses[view], 5) << view;
}

TEST(KeyframeSchedule, TheNewestViewGetsItsShare) {
  ScheduleOptions options;
  options.newest_probability = 0.3;
  KeyframeSchedule schedule(options, 640, 480, 4);
  for (int i = 0; i < 100; ++i) schedule.add_view();
  int newest = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) newest += schedule.next(false).view == 99;
  const double expected = 0.3 + 0.7 / 100;
  EXPECT_NEAR(static_cast<double>(newest) / kDraws, expected, 0.015);  // 4.6 standard deviations
}

TEST(KeyframeSchedule, TheNewestTakesTurnsWithSeamsUntilItIsTaught) {
  ScheduleOptions options;
  options.newest_probability = 1;
  options.uses_per_level = 3;
  options.seam_uses = 20;
  options.start_pixels = 160 * 120;
  KeyframeSchedule schedule(options, 640, 480, 5);
  ASSERT_EQ(schedule.coarsest_level() - schedule.online_level(), 1);
  for (int i = 0; i < 4; ++i) schedule.add_view();
  schedule.revisit(std::vector{1, 2});
  std::vector<bool> newest;
  for (int i = 0; i < 20; ++i) newest.push_back(schedule.next(false).view == 3);
  for (size_t i = 0; i < 20; ++i) EXPECT_EQ(newest[i], i < 12 && i % 2 == 0) << i;
  schedule.add_view();
  EXPECT_EQ(schedule.next(false).view, 4) << "the next one does not wait either";
  EXPECT_NE(schedule.next(false).view, 4);
  EXPECT_NE(schedule.next(true).view, 4) << "nothing arrives any more";
  schedule.retire(4);
  EXPECT_NE(schedule.next(false).view, 4);
}

TEST(KeyframeSchedule, SeamsComeBeforeANewestThatIsTaught) {
  ScheduleOptions options;
  options.newest_probability = 1;
  options.uses_per_level = 1;
  options.seam_uses = 2;
  KeyframeSchedule schedule(options, 640, 480, 5);
  for (int i = 0; i < 4; ++i) schedule.add_view();
  for (int i = 0; i < 2; ++i) EXPECT_EQ(schedule.next(false).view, 3);
  schedule.revisit(std::vector{1});
  EXPECT_EQ(schedule.next(false).view, 1);
  EXPECT_EQ(schedule.next(false).view, 1);
  EXPECT_FALSE(schedule.is_revisiting());
  EXPECT_EQ(schedule.next(false).view, 3);
}

TEST(KeyframeSchedule, ARetiredViewDoesNotComeAgain) {
  KeyframeSchedule schedule({}, 640, 480, 6);
  for (int i = 0; i < 5; ++i) schedule.add_view();
  schedule.next(true);  // a round has begun
  schedule.retire(1);
  schedule.retire(4);
  EXPECT_EQ(std::vector(schedule.active().begin(), schedule.active().end()), (std::vector{0, 2, 3}));
  std::map<int, int> uses;
  for (int i = 0; i < 200; ++i) ++uses[schedule.next(false).view];
  EXPECT_EQ(uses.size(), 3u);
  EXPECT_FALSE(uses.contains(1) || uses.contains(4));
}

TEST(KeyframeSchedule, TheWorseViewOutOfTwoComes) {
  ScheduleOptions options;
  options.worse_probability = 1;
  KeyframeSchedule schedule(options, 640, 480, 7);
  constexpr int kViews = 5, kDraws = 20000;
  for (int i = 0; i < kViews; ++i) {
    schedule.add_view();
    schedule.report(i, 0.1 * i);
  }
  std::map<int, int> uses;
  for (int i = 0; i < kDraws; ++i) ++uses[schedule.next(true).view];
  for (int i = 0; i < kViews; ++i) {
    const double expected = (2.0 * i + 1) / (kViews * kViews);  // the larger of two uniform draws
    EXPECT_NEAR(static_cast<double>(uses[i]) / kDraws, expected, 0.016) << i;
  }
}

TEST(KeyframeSchedule, ViewsAtSeamsGoFirst) {
  ScheduleOptions options;
  options.seam_uses = 3;
  KeyframeSchedule schedule(options, 640, 480, 5);
  for (int i = 0; i < 10; ++i) schedule.add_view();
  schedule.revisit(std::vector{2, 5});
  EXPECT_EQ(schedule.next(true).view % 3, 2);
  schedule.revisit(std::vector{5, 8});  // again: 5 has three uses left, no more
  std::map<int, int> uses;
  while (schedule.is_revisiting()) ++uses[schedule.next(true).view];
  EXPECT_EQ(uses[5], 3);
  EXPECT_EQ(uses[8], 3);
  EXPECT_GE(uses[2], 2);
  EXPECT_EQ(uses.size(), 3u);
  for (int i = 0; i < 10; ++i) ++uses[schedule.next(true).view];
  EXPECT_EQ(uses.size(), 10u) << "then a round of all";
}

}  // namespace
}  // namespace photoslam
