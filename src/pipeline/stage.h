// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "base/bounded_queue.h"

namespace photoslam {

/// What the exception that is being handled says.
inline std::string exception_text() {
  try {
    throw;
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "something was thrown that is no std::exception and does not say what has failed";
  }
}

/// The first component that threw, and what it said. Reporting a failure asks the whole pipeline to stop.
class FailureReport {
 public:
  explicit FailureReport(std::stop_source& stop) : stop_(stop) {}
  void report(const std::string& component, const std::string& what) {
    {
      std::lock_guard lock(mutex_);
      if (text_.empty()) text_ = component + ": " + what;
    }
    stop_.request_stop();
  }
  std::string text() const {
    std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  std::stop_source& stop_;
  mutable std::mutex mutex_;
  std::string text_;
};

/// A component at work: messages go in through a bounded queue and are handled in order, on the stage's own thread or,
/// for single-threaded runs, by the poster. After an exception the stage reports it and ignores what still comes.
template <class Message>
class Stage {
 public:
  struct Work {
    std::string name;
    std::function<void(Message)> handle;
    std::function<bool()> idle = {};      ///< Called while nothing waits; false: nothing to do until a message comes.
    std::function<void()> on_start = {};  ///< Runs first on the stage's thread.
    /// With this, posters never wait: the queue grows, but before each message this may change or remove what waits,
    /// oldest first. Called by the poster.
    std::function<void(const Message& newer, std::deque<Message>& waiting)> make_way = {};
  };

  Stage(size_t capacity, bool threaded, Work work, FailureReport& failures)
      : queue_(capacity, work.make_way ? Overflow::grow : Overflow::block),
        work_(std::move(work)),
        failures_(failures),
        threaded_(threaded) {
    if (threaded_) thread_ = std::thread([this] { loop(); });
  }
  ~Stage() { finish(); }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// Waits while the queue is full, unless Work::make_way says otherwise.
  void post(Message message) {
    if (threaded_ && work_.make_way) {
      queue_.push(std::move(message), work_.make_way);
    } else if (threaded_) {
      queue_.push(std::move(message));
    } else {
      guarded([&] { work_.handle(std::move(message)); });
    }
  }

  /// Handles everything that was posted, then ends the thread.
  void finish() {
    queue_.close();
    if (thread_.joinable()) thread_.join();
  }

  /// Messages that nobody has started to handle.
  size_t backlog() const { return queue_.size(); }

 private:
  void loop() {
    if (work_.on_start) guarded(work_.on_start);
    while (true) {
      std::optional<Message> message = queue_.try_pop();
      if (!message) {
        if (queue_.finished()) return;
        bool worked = false;
        if (work_.idle) guarded([&] { worked = work_.idle(); });
        if (worked) continue;
        message = queue_.pop();
        if (!message) return;
      }
      guarded([&] { work_.handle(std::move(*message)); });
    }
  }

  template <class Function>
  void guarded(Function&& function) {
    if (failed_) return;
    try {
      function();
    } catch (...) {
      failed_ = true;
      failures_.report(work_.name, exception_text());
    }
  }

  BoundedQueue<Message> queue_;
  Work work_;
  FailureReport& failures_;
  bool threaded_;
  bool failed_ = false;  // touched by the handling thread only
  std::thread thread_;
};

}  // namespace photoslam
