// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <thread>

namespace photoslam {

/// Wall-clock stopwatch.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  double milliseconds() const { return seconds() * 1e3; }
  void restart() { start_ = std::chrono::steady_clock::now(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// CPU time used so far by the calling thread [s].
double thread_cpu_seconds();
/// The same of another thread, which has not been joined yet; 0 where the system does not tell.
double thread_cpu_seconds(std::thread& thread);
/// CPU time used so far by the whole process [s].
double process_cpu_seconds();
/// Largest resident set so far [MB, 1e6 bytes].
double peak_rss_mb();
/// Resident set now [MB]; 0 where the system does not tell.
double current_rss_mb();
/// How far a thread steps back behind those that track: its nice value.
enum class ThreadPriority {
  supporting = 10,  ///< Tracking needs the result soon: reading frames, geometry mapping.
  background = 19,  ///< Whatever time is left.
};
/// Lowers the calling thread's scheduling priority for good; without effect where not supported.
void lower_thread_priority(ThreadPriority priority);

}  // namespace photoslam
