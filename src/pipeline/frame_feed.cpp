// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_feed.h"

#include <algorithm>

namespace photoslam {

using std::chrono::steady_clock;

FrameFeed::FrameFeed(FrameSource& source, Pace pace, size_t capacity, bool threaded, std::stop_token stop,
                     FailureReport& failures)
    : source_(source),
      pace_(pace),
      stop_(std::move(stop)),
      failures_(failures),
      queue_(capacity, pace == Pace::realtime ? Overflow::drop_oldest : Overflow::block),
      threaded_(threaded) {
  if (threaded_) thread_ = std::thread([this] { read_all(); });
}

FrameFeed::~FrameFeed() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

std::optional<FedFrame> FrameFeed::next() {
  if (threaded_) return queue_.pop();
  if (stop_.stop_requested()) return std::nullopt;
  std::optional<Frame> frame = source_.next();
  if (!frame) return std::nullopt;
  const auto now = steady_clock::now();
  return FedFrame{std::move(*frame), now, now};
}

int64_t FrameFeed::timestamp_ns(FrameId frame) const {
  std::lock_guard lock(mutex_);
  return timestamps_.at(frame);
}

void FrameFeed::wait_until(SteadyTime due) {
  constexpr auto kStopCheck = std::chrono::milliseconds(50);  // a stop is noticed at least this often
  while (!stop_.stop_requested()) {
    const auto now = steady_clock::now();
    if (now >= due) return;
    std::this_thread::sleep_for(std::min<steady_clock::duration>(due - now, kStopCheck));
  }
}

void FrameFeed::read_all() {
  try {
    SteadyTime start;
    std::optional<int64_t> first_ns;
    while (!stop_.stop_requested()) {
      std::optional<Frame> frame = source_.next();
      if (!frame) break;
      SteadyTime due = steady_clock::now();
      if (pace_ == Pace::realtime) {
        if (!first_ns) {
          first_ns = frame->timestamp_ns;
          start = due;
        }
        due = start + std::chrono::nanoseconds(frame->timestamp_ns - *first_ns);
        wait_until(due);
      }
      {
        std::lock_guard lock(mutex_);
        timestamps_[frame->id] = frame->timestamp_ns;
      }
      if (!queue_.push({std::move(*frame), due, steady_clock::now()})) break;
    }
  } catch (const std::exception& e) {
    failures_.report("input", e.what());
  }
  queue_.close();
}

}  // namespace photoslam
