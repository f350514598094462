// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>
#include <thread>

namespace photoslam {

/// Turns Ctrl-C and SIGTERM into a stop request; a second one ends the process at once. Create it before any other
/// thread: threads inherit the blocked signals.
class InterruptGuard {
 public:
  /// What the user is told to happen next, in static memory.
  explicit InterruptGuard(const char* consequence = "saving what was made so far");
  std::stop_token token() const { return stop_.get_token(); }

 private:
  std::stop_source stop_;
  std::jthread waiter_;
};

}  // namespace photoslam
