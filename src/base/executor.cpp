// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/executor.h"

#include <atomic>
#include <exception>

#include "base/check.h"
#include "base/clock.h"

namespace photoslam {

void SerialExecutor::for_each(int count, const std::function<void(int, int)>& task) {
  std::exception_ptr failure;
  for (int i = 0; i < count; ++i) {
    try {
      task(i, 0);
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

/// One for_each call. Lives on the caller's stack: `workers_inside` keeps it alive until everybody has left.
struct ThreadPool::Batch {
  const std::function<void(int, int)>& task;
  int count;
  std::atomic<int> next{0};
  int workers_inside = 0;  // guarded by the pool's mutex
  std::mutex failure_mutex;
  std::exception_ptr failure;

  void drain(int worker) {
    for (int i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
      try {
        task(i, worker);
      } catch (...) {
        std::lock_guard lock(failure_mutex);
        if (!failure) failure = std::current_exception();
      }
    }
  }
};

ThreadPool::ThreadPool(int concurrency, std::function<void()> on_start) {
  PHOTOSLAM_CHECK(concurrency >= 1, "concurrency {}", concurrency);
  for (int worker = 1; worker < concurrency; ++worker) {
    threads_.emplace_back([this, worker, on_start] {
      if (on_start) on_start();
      work(worker);
    });
  }
}

ThreadPool::~ThreadPool() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  batch_started_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::for_each(int count, const std::function<void(int, int)>& task) {
  Batch batch{.task = task, .count = count, .failure_mutex = {}, .failure = {}};
  if (threads_.empty() || count <= 1) {
    batch.drain(0);
  } else {
    {
      std::lock_guard lock(mutex_);
      PHOTOSLAM_CHECK(batch_ == nullptr, "ThreadPool::for_each is not reentrant");
      batch_ = &batch;
      ++generation_;
    }
    batch_started_.notify_all();
    batch.drain(0);
    std::unique_lock lock(mutex_);
    batch_ = nullptr;  // nobody enters any more
    batch_finished_.wait(lock, [&] { return batch.workers_inside == 0; });
  }
  if (batch.failure) std::rethrow_exception(batch.failure);
}

double ThreadPool::helper_cpu_seconds() {
  double seconds = 0;
  for (std::thread& thread : threads_) seconds += thread_cpu_seconds(thread);
  return seconds;
}

void ThreadPool::work(int worker) {
  unsigned long seen = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    batch_started_.wait(lock, [&] { return stopping_ || (batch_ != nullptr && generation_ != seen); });
    if (stopping_) return;
    seen = generation_;
    Batch* batch = batch_;
    ++batch->workers_inside;
    lock.unlock();
    batch->drain(worker);
    lock.lock();
    if (--batch->workers_inside == 0) batch_finished_.notify_all();
  }
}

}  // namespace photoslam
