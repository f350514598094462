// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_feed.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace photoslam {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

/// Empty frames at a fixed interval; throws at one of them if asked.
class EmptyFrames : public FrameSource {
 public:
  EmptyFrames(int count, int interval_ms, int throw_at = -1)
      : count_(count), interval_ms_(interval_ms), throw_at_(throw_at) {}
  const SourceInfo& info() const override { return info_; }
  std::optional<Frame> next() override {
    if (num_read == throw_at_) throw std::runtime_error("the cable is out");
    if (num_read == count_) return std::nullopt;
    Frame frame;
    frame.id = FrameId(num_read);
    frame.timestamp_ns = 1'000'000'000'000 + int64_t{1'000'000} * interval_ms_ * num_read;
    ++num_read;
    return frame;
  }
  std::atomic<int> num_read = 0;

 private:
  int count_, interval_ms_, throw_at_;
  SourceInfo info_;
};

class FrameFeedTest : public testing::Test {
 protected:
  std::vector<int> take_all(FrameFeed& feed) {
    std::vector<int> ids;
    while (const auto fed = feed.next()) ids.push_back(fed->frame.id.value);
    return ids;
  }
  std::stop_source stop_;
  FailureReport failures_{stop_};
};

TEST_F(FrameFeedTest, AsapDeliversEveryFrameInOrderToASlowReader) {
  EmptyFrames source(50, 1000);
  FrameFeed feed(source, Pace::asap, 3, true, stop_.get_token(), failures_);
  std::this_thread::sleep_for(milliseconds(30));
  EXPECT_LE(source.num_read, 3 + 1) << "the reader waits for a full queue";
  const std::vector<int> ids = take_all(feed);
  ASSERT_EQ(ids.size(), 50u);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(ids[static_cast<size_t>(i)], i);
}

TEST_F(FrameFeedTest, ReadsInPlaceWithoutAThread) {
  EmptyFrames source(3, 1000);
  FrameFeed feed(source, Pace::asap, 3, false, stop_.get_token(), failures_);
  EXPECT_EQ(source.num_read, 0);
  EXPECT_TRUE(feed.next().has_value());
  EXPECT_EQ(source.num_read, 1);
  EXPECT_EQ(take_all(feed).size(), 2u);
}

TEST_F(FrameFeedTest, RealTimeNeverReleasesAFrameBeforeItsTime) {
  EmptyFrames source(6, 20);
  const auto start = steady_clock::now();
  FrameFeed feed(source, Pace::realtime, 3, true, stop_.get_token(), failures_);
  for (int i = 0; i < 6; ++i) {
    const auto fed = feed.next();
    ASSERT_TRUE(fed.has_value());
    EXPECT_GE(steady_clock::now() - start, milliseconds(20 * i));
    EXPECT_GE(fed->due - start, milliseconds(20 * i));
  }
}

TEST_F(FrameFeedTest, RealTimeKeepsTheNewestForAReaderThatStalls) {
  EmptyFrames source(20, 1);
  FrameFeed feed(source, Pace::realtime, 3, true, stop_.get_token(), failures_);
  while (source.num_read < 20) std::this_thread::sleep_for(milliseconds(1));
  std::this_thread::sleep_for(milliseconds(50));  // the last frame's time has come and gone
  EXPECT_EQ(take_all(feed), (std::vector<int>{17, 18, 19}));
  EXPECT_EQ(feed.timestamp_ns(FrameId(5)), 1'000'005'000'000) << "dropped frames keep their timestamps";
}

/// One frame takes long to read.
class SlowDisk : public EmptyFrames {
 public:
  SlowDisk() : EmptyFrames(12, 40) {}
  std::optional<Frame> next() override {
    if (num_read == 8) std::this_thread::sleep_for(milliseconds(150));
    return EmptyFrames::next();
  }
};

TEST_F(FrameFeedTest, AFrameThatTakesLongToReadIsReadAheadOfItsTime) {
  SlowDisk source;
  FrameFeed feed(source, Pace::realtime, 3, true, stop_.get_token(), failures_);
  int released = 0;
  while (const auto fed = feed.next()) {
    if (released == 4) {
      EXPECT_GE(source.num_read, 8) << "the first eight are read at once";
    }
    ++released;
  }
  EXPECT_EQ(released, 12);
}

TEST_F(FrameFeedTest, StopEndsTheWaitForALateFrame) {
  EmptyFrames source(2, 3'600'000);
  FrameFeed feed(source, Pace::realtime, 3, true, stop_.get_token(), failures_);
  EXPECT_TRUE(feed.next().has_value());
  stop_.request_stop();
  const auto start = steady_clock::now();
  take_all(feed);
  EXPECT_LT(steady_clock::now() - start, std::chrono::seconds(30));
}

TEST_F(FrameFeedTest, AFailingSourceStopsTheRunAndIsNamed) {
  EmptyFrames source(20, 1, 4);
  FrameFeed feed(source, Pace::asap, 30, true, stop_.get_token(), failures_);
  EXPECT_LE(take_all(feed).size(), 4u);
  EXPECT_EQ(failures_.text(), "input: the cable is out");
  EXPECT_TRUE(stop_.stop_requested());
}

/// Every third frame only.
class WithGaps final : public FrameSource {
 public:
  const SourceInfo& info() const override { return info_; }
  std::optional<Frame> next() override {
    if (next_ > 9) return std::nullopt;
    Frame frame;
    frame.id = FrameId(next_);
    frame.timestamp_ns = 100 + 10 * next_;
    next_ += 3;
    return frame;
  }

 private:
  int next_ = 0;
  SourceInfo info_;
};

TEST_F(FrameFeedTest, FramesThatTheSourceLeftOutLieBetweenTheirNeighbours) {
  for (const bool threaded : {false, true}) {
    WithGaps source;
    FrameFeed feed(source, Pace::asap, 3, threaded, stop_.get_token(), failures_);
    EXPECT_EQ(take_all(feed), (std::vector<int>{0, 3, 6, 9}));
    for (int i = 0; i <= 9; ++i) {
      EXPECT_EQ(feed.timestamp_ns(FrameId(i)), 100 + 10 * i) << i;
      EXPECT_EQ(feed.was_read(FrameId(i)), i % 3 == 0) << i;
    }
  }
}

class ThrowsANumber final : public EmptyFrames {
 public:
  ThrowsANumber() : EmptyFrames(3, 1) {}
  std::optional<Frame> next() override { throw 42; }
};

TEST_F(FrameFeedTest, WhateverASourceThrowsIsReported) {
  ThrowsANumber source;
  FrameFeed feed(source, Pace::asap, 3, true, stop_.get_token(), failures_);
  EXPECT_TRUE(take_all(feed).empty());
  EXPECT_TRUE(failures_.text().starts_with("input: ")) << failures_.text();
}

}  // namespace
}  // namespace photoslam
