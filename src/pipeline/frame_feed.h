// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
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
/// its oldest frame, else the reader waits.
class FrameFeed {
 public:
  /// Without a thread, next() reads; that is for single-threaded runs, which have no pace.
  FrameFeed(FrameSource& source, Pace pace, size_t capacity, bool threaded, std::stop_token stop,
            FailureReport& failures);
  ~FrameFeed();

  /// The next frame; nothing at the end of the input or after a stop.
  std::optional<FedFrame> next();

  /// Of a frame that was read, also if it was dropped.
  int64_t timestamp_ns(FrameId frame) const;

 private:
  void read_all();
  void wait_until(SteadyTime due);

  FrameSource& source_;
  Pace pace_;
  std::stop_token stop_;
  FailureReport& failures_;
  BoundedQueue<FedFrame> queue_;
  bool threaded_;
  mutable std::mutex mutex_;
  std::map<FrameId, int64_t> timestamps_;
  std::thread thread_;
};

}  // namespace photoslam
