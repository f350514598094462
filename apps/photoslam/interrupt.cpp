// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "interrupt.h"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <ctime>
#include <string_view>

namespace photoslam {
namespace {

constexpr int kExitInterrupted = 130;

void say(std::string_view text) {
  if (::write(STDERR_FILENO, text.data(), text.size()) < 0) return;
}

void wait_for_signals(const std::stop_token& finished, std::stop_source& stop, const sigset_t& signals,
                      const char* consequence) {
  while (!finished.stop_requested()) {
    constexpr timespec kPoll{.tv_sec = 0, .tv_nsec = 100'000'000};
    if (sigtimedwait(&signals, nullptr, &kPoll) < 0) continue;
    if (stop.stop_requested()) ::_exit(kExitInterrupted);
    say("\nphotoslam: stopping; ");
    say(consequence);
    say(" (press again to quit at once)\n");
    stop.request_stop();
  }
}

}  // namespace

InterruptGuard::InterruptGuard(const char* consequence) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  waiter_ = std::jthread([this, signals, consequence](const std::stop_token& finished) {
    wait_for_signals(finished, stop_, signals, consequence);
  });
}

}  // namespace photoslam
