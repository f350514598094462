// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cuda/device_memory.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace photoslam::splatting::cuda {
namespace {

TEST(Budget, IsKeptByThreadsTogether) {
  constexpr uint64_t kLimit = 100;
  Budget budget(kLimit);
  std::atomic<uint64_t> in_use{0};
  const auto spend = [&](uint64_t bytes) {
    for (int i = 0; i < 20000; ++i) {
      if (!budget.take(bytes)) continue;
      EXPECT_LE(in_use += bytes, kLimit);
      budget.record_peak();
      in_use -= bytes;
      budget.give_back(bytes);
    }
  };
  std::thread other(spend, 60);
  spend(50);
  other.join();
  EXPECT_EQ(budget.used(), 0u);
  spend(60);  // the other thread may have found 50 in use each time
  EXPECT_EQ(budget.peak(), 60u);
  EXPECT_FALSE(budget.take(kLimit + 1));
  EXPECT_FALSE(budget.take(~uint64_t{0}));
  EXPECT_TRUE(budget.take(kLimit));
  EXPECT_FALSE(budget.take(1));
}

}  // namespace
}  // namespace photoslam::splatting::cuda
