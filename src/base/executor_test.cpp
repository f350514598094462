// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/executor.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <stdexcept>

#include "base/clock.h"

namespace photoslam {
namespace {

TEST(ThreadPool, RunsEveryTaskExactlyOnce) {
  ThreadPool pool(3);
  for (int count : {0, 1, 2, 7, 1000}) {
    std::vector<std::atomic<int>> runs(static_cast<size_t>(count));
    pool.for_each(count, [&](int i, int worker) {
      EXPECT_GE(worker, 0);
      EXPECT_LT(worker, pool.concurrency());
      ++runs[static_cast<size_t>(i)];
    });
    for (const auto& r : runs) EXPECT_EQ(r, 1);
  }
}

TEST(ThreadPool, SurvivesManySmallBatches) {
  ThreadPool pool(4);
  std::atomic<long> sum = 0;
  for (int batch = 0; batch < 2000; ++batch) pool.for_each(5, [&](int i, int) { sum += i; });
  EXPECT_EQ(sum, 2000 * 10);
}

TEST(ThreadPool, CountsTheTimeOfItsHelpersAlone) {
  ThreadPool pool(3);
  const double before = pool.helper_cpu_seconds();
  // No worker comes back for a second task before all three have one.
  std::atomic<int> inside = 0;
  std::array<double, 3> used{};
  pool.for_each(3, [&](int, int worker) {
    const double start = thread_cpu_seconds();
    for (++inside; inside < 3 || thread_cpu_seconds() - start < 0.02;) {
    }
    used[static_cast<size_t>(worker)] = thread_cpu_seconds() - start;
  });
  const double counted = pool.helper_cpu_seconds() - before;
  EXPECT_GE(counted, used[1] + used[2]);
  EXPECT_LE(counted, used[1] + used[2] + 0.01);
  EXPECT_EQ(SerialExecutor().helper_cpu_seconds(), 0);
}

TEST(ThreadPool, RethrowsTheTaskFailureAfterAllTasksRan) {
  ThreadPool pool(2);
  std::atomic<int> ran = 0;
  EXPECT_THROW(pool.for_each(10,
                             [&](int i, int) {
                               ++ran;
                               if (i == 3) throw std::runtime_error("task 3");
                             }),
               std::runtime_error);
  EXPECT_EQ(ran, 10);
}

TEST(SerialExecutor, KeepsOrder) {
  SerialExecutor serial;
  std::vector<int> order;
  serial.for_each(4, [&](int i, int) { order.push_back(i); });
  EXPECT_EQ(order, (std::vector{0, 1, 2, 3}));
}

}  // namespace
}  // namespace photoslam
