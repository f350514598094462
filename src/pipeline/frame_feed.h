// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "base/bounded_queue.h"
#include "pipeline/run_settings.h"
#include "pipeline/stage.h"
#include "sources/frame.h"

namespace photoslam {

using SteadyTime = std::chrono::steady_clock::time_point;

/// A frame on its way into the system.
struct FedFrame {
  Frame frame;
  SteadyTime due;     ///< When it should arrive at real-time pace; when it was read otherwise.
  SteadyTime queued;  ///< When it entered the queue.
};

/// Reads a source on its own thread and releases the frames at the chosen pace. At real-time pace a full queue drops
/// its oldest frame, else the reader waits. Then a second thread releases, so that the reader can be kReadAhead frames
/// early and a slow disk delays nothing.
class FrameFeed {
 public:
  static constexpr size_t kReadAhead = 10;

  /// Without a thread, next() reads; that is for single-threaded runs, which have no pace.
  FrameFeed(FrameSource& source, Pace pace, size_t capacity, bool threaded, std::stop_token stop,
            FailureReport& failures);
  ~FrameFeed();

  /// The next frame; nothing at the end of the input or after a stop.
  std::optional<FedFrame> next();

  /// Of any frame up to the one that next() gave last. Those that the source left out lie between their neighbours.
  int64_t timestamp_ns(FrameId frame) const;
  /// Whether the source has delivered it.
  bool was_read(FrameId frame) const;

 private:
  struct ReadFrame {
    Frame frame;
    SteadyTime when;
  };

  void read_all();
  void release_all();
  bool release(Frame frame, SteadyTime due);
  void note_time(const Frame& frame);
  void finish();
  void wait_until(SteadyTime due);

  FrameSource& source_;
  Pace pace_;
  std::stop_token stop_;
  FailureReport& failures_;
  BoundedQueue<ReadFrame> early_{kReadAhead, Overflow::block};  ///< Frames whose time has not come.
  std::string failure_;  ///< Why reading ended early; told when the frames before have been released.
  BoundedQueue<FedFrame> queue_;
  bool threaded_;
  mutable std::mutex mutex_;
  std::map<FrameId, int64_t> timestamps_;
  std::thread reader_, releaser_;
};

}  // namespace photoslam
