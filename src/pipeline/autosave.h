// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/result.h"

namespace photoslam {

/// When the session is to be saved in between, and what has failed. From any thread.
class Autosave {
 public:
  /// So long from the end of one save to the begin of the next; 0: never.
  explicit Autosave(double interval_s) : interval_s_(interval_s) {}

  /// Whether a save is due. Then the caller sees to it, and no other is due before ended().
  bool begin() {
    std::lock_guard lock(mutex_);
    if (interval_s_ <= 0 || saving_ || since_last_.seconds() < interval_s_) return false;
    return saving_ = true;
  }
  /// Also when nothing was saved after all.
  void ended(const Status& status = {}) {
    std::lock_guard lock(mutex_);
    saving_ = false;
    since_last_.restart();
    if (status) return;
    failures_.push_back(
        fmt::format("the session is not saved: {}; the next try is in {:g} s", status.error().message, interval_s_));
  }
  /// What has failed since the last call, one line per failure.
  std::vector<std::string> take_failures() {
    std::lock_guard lock(mutex_);
    return std::exchange(failures_, {});
  }

 private:
  const double interval_s_;
  std::mutex mutex_;
  Stopwatch since_last_;
  bool saving_ = false;
  std::vector<std::string> failures_;
};

}  // namespace photoslam
