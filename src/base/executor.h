// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace photoslam {

/// Runs independent tasks. Algorithms take one by reference and never create threads themselves.
///
/// A result must not depend on which worker runs which task: then it is the same at any concurrency.
class Executor {
 public:
  virtual ~Executor() = default;

  /// Number of workers, the calling thread included; worker indices are in [0, concurrency()).
  virtual int concurrency() const = 0;

  /// Calls task(i, worker) once for every i in [0, count) and returns when all have finished.
  /// The first exception thrown by a task is rethrown here; the other tasks still run.
  virtual void for_each(int count, const std::function<void(int index, int worker)>& task) = 0;

  /// CPU time used so far by the workers that are not calling threads [s].
  virtual double helper_cpu_seconds() { return 0; }
};

/// Runs every task in order on the calling thread.
class SerialExecutor final : public Executor {
 public:
  int concurrency() const override { return 1; }
  void for_each(int count, const std::function<void(int, int)>& task) override;
};

/// A fixed pool: the calling thread and concurrency − 1 workers that sleep when idle (they never spin).
class ThreadPool final : public Executor {
 public:
  /// on_start runs first on every worker thread (to lower its priority, for example).
  explicit ThreadPool(int concurrency, std::function<void()> on_start = {});
  ~ThreadPool() override;
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int concurrency() const override { return static_cast<int>(threads_.size()) + 1; }
  void for_each(int count, const std::function<void(int, int)>& task) override;
  double helper_cpu_seconds() override;

 private:
  struct Batch;
  void work(int worker);

  std::mutex mutex_;
  std::condition_variable batch_started_;
  std::condition_variable batch_finished_;
  Batch* batch_ = nullptr;
  unsigned long generation_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace photoslam
