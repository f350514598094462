// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stage.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace photoslam {
namespace {

class StageTest : public ::testing::TestWithParam<bool> {
 protected:
  std::stop_source stop;
  FailureReport failures{stop};
};

TEST_P(StageTest, HandlesEverythingInOrderBeforeItFinishes) {
  std::vector<int> seen;
  {
    Stage<int> stage(3, GetParam(), {.name = "test", .handle = [&](int i) { seen.push_back(i); }}, failures);
    for (int i = 0; i < 100; ++i) stage.post(i);
    stage.finish();
    EXPECT_EQ(seen.size(), 100u);
  }
  for (int i = 0; i < 100; ++i) EXPECT_EQ(seen[static_cast<size_t>(i)], i);
  EXPECT_FALSE(stop.stop_requested());
}

TEST_P(StageTest, AThrowingComponentIsNamedAndStopsThePipelineWithoutBlockingIt) {
  int handled = 0;
  Stage<int> stage(2, GetParam(),
                   {.name = "geometry mapping",
                    .handle =
                        [&](int i) {
                          if (i == 3) throw std::runtime_error("broken map");
                          ++handled;
                        }},
                   failures);
  for (int i = 0; i < 50; ++i) stage.post(i);
  stage.finish();
  EXPECT_EQ(handled, 3);
  EXPECT_TRUE(stop.stop_requested());
  EXPECT_EQ(failures.text(), "geometry mapping: broken map");
}

TEST_P(StageTest, WhateverIsThrownIsReported) {
  Stage<int> stage(2, GetParam(), {.name = "mapping", .handle = [](int i) { throw i; }}, failures);
  stage.post(1);
  stage.post(2);
  stage.finish();
  EXPECT_TRUE(stop.stop_requested());
  EXPECT_TRUE(failures.text().starts_with("mapping: ")) << failures.text();
  EXPECT_NE(failures.text().find("no std::exception"), std::string::npos) << failures.text();
}

INSTANTIATE_TEST_SUITE_P(Threading, StageTest, ::testing::Bool(),
                         [](const auto& suite) { return suite.param ? "OwnThread" : "Inline"; });

TEST(Stage, WhereOthersMakeWayNobodyWaits) {
  std::stop_source stop;
  FailureReport failures{stop};
  std::atomic<bool> may_go_on = false;
  std::vector<int> seen;
  Stage<int> stage(2, true,
                   {.name = "slow",
                    .handle =
                        [&](int i) {
                          while (!may_go_on) std::this_thread::yield();
                          seen.push_back(i);
                        },
                    .make_way =
                        [](int newer, std::deque<int>& waiting) {
                          if (!waiting.empty() && waiting.back() < 0 && newer != 50) waiting.pop_back();
                        }},
                   failures);
  stage.post(0);
  while (stage.backlog() > 0) std::this_thread::yield();  // it is being handled
  for (int i = 1; i < 100; ++i) {
    stage.post(-i);  // makes way for the next one
    stage.post(i);
  }
  may_go_on = true;
  stage.finish();
  std::vector<int> expected;
  for (int i = 0; i < 50; ++i) expected.push_back(i);
  expected.push_back(-50);
  for (int i = 50; i < 100; ++i) expected.push_back(i);
  EXPECT_EQ(seen, expected);
}

TEST(Stage, WorksWhileIdleAndSleepsWhenThereIsNothingToDo) {
  std::stop_source stop;
  FailureReport failures{stop};
  std::atomic<int> idle_calls = 0;
  Stage<int> stage(2, true, {.name = "idle", .handle = [](int) {}, .idle = [&] { return ++idle_calls < 10; }},
                   failures);
  while (idle_calls < 10) std::this_thread::yield();
  stage.post(1);  // wakes it: idle is asked once more
  while (idle_calls < 11) std::this_thread::yield();
  stage.finish();
  EXPECT_LE(idle_calls, 12);
}

}  // namespace
}  // namespace photoslam
