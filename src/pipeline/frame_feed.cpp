// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_feed.h"

#include <algorithm>
#include <iterator>

#include "base/check.h"
#include "base/clock.h"

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
  if (!threaded_) return;
  reader_ = std::thread([this] { read_all(); });
  if (pace_ == Pace::realtime) releaser_ = std::thread([this] { release_all(); });
}

FrameFeed::~FrameFeed() {
  early_.close();
  queue_.close();
  if (reader_.joinable()) reader_.join();
  if (releaser_.joinable()) releaser_.join();
}

std::optional<FedFrame> FrameFeed::next() {
  if (threaded_) return queue_.pop();
  if (stop_.stop_requested()) return std::nullopt;
  std::optional<Frame> frame = source_.next();
  if (!frame) return std::nullopt;
  note_time(*frame);
  const auto now = steady_clock::now();
  return FedFrame{std::move(*frame), now, now};
}

int64_t FrameFeed::timestamp_ns(FrameId frame) const {
  std::lock_guard lock(mutex_);
  const auto after = timestamps_.lower_bound(frame);
  PHOTOSLAM_CHECK(after != timestamps_.end(), "frame {}", frame.value);
  if (after->first == frame || after == timestamps_.begin()) return after->second;
  const auto before = std::prev(after);
  const double share = static_cast<double>(frame.value - before->first.value) /
                       static_cast<double>(after->first.value - before->first.value);
  return before->second + static_cast<int64_t>(share * static_cast<double>(after->second - before->second));
}

bool FrameFeed::was_read(FrameId frame) const {
  std::lock_guard lock(mutex_);
  return timestamps_.contains(frame);
}

void FrameFeed::note_time(const Frame& frame) {
  std::lock_guard lock(mutex_);
  timestamps_[frame.id] = frame.timestamp_ns;
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
  // Tracking comes first: files are read well ahead of their time, and a camera waits in its driver's buffers.
  lower_thread_priority(ThreadPriority::supporting);
  try {
    while (!stop_.stop_requested()) {
      std::optional<Frame> frame = source_.next();
      if (!frame) break;
      const auto now = steady_clock::now();
      const bool taken =
          pace_ == Pace::realtime ? early_.push({std::move(*frame), now}) : release(std::move(*frame), now);
      if (!taken) break;
    }
  } catch (...) {
    std::lock_guard lock(mutex_);
    failure_ = exception_text();
  }
  early_.close();
  if (pace_ != Pace::realtime) finish();
}

void FrameFeed::release_all() {
  std::optional<SteadyTime> start;
  int64_t first_ns = 0;
  while (std::optional<ReadFrame> read = early_.pop()) {
    if (!start) {
      start = read->when;
      first_ns = read->frame.timestamp_ns;
    }
    const SteadyTime due = *start + std::chrono::nanoseconds(read->frame.timestamp_ns - first_ns);
    wait_until(due);
    if (stop_.stop_requested()) break;
    if (!release(std::move(read->frame), due)) break;
  }
  early_.close();
  finish();
}

void FrameFeed::finish() {
  {
    std::lock_guard lock(mutex_);
    if (!failure_.empty()) failures_.report("input", failure_);
  }
  queue_.close();
}

bool FrameFeed::release(Frame frame, SteadyTime due) {
  note_time(frame);
  return queue_.push({std::move(frame), due, steady_clock::now()});
}

}  // namespace photoslam
