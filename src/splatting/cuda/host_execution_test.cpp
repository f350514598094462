// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#ifndef __SANITIZE_THREAD__  // it does not know fibers
#include "splatting/cuda/host_execution.h"

#include <gtest/gtest.h>

namespace photoslam::splatting::cuda {
namespace {

struct ConnectThreads {
  static constexpr int kThreads = 64;
  struct Shared {
    int values[64];
  };
  int* out;
  void operator()(HostGroup& group, Shared& shared) const {
    shared.values[group.thread()] = group.thread();
    group.sync();
    const int other = shared.values[63 - group.thread()];
    const bool odd = group.lane() % 2 == 1;
    EXPECT_EQ(group.ballot(odd), 0xaaaaaaaau);
    EXPECT_EQ(group.match(group.lane() < 4 ? 1 : 2), group.lane() < 4 ? 0xfu : 0xfffffff0u);
    EXPECT_EQ(group.exchange(static_cast<float>(group.lane()), 5), static_cast<float>(group.lane() ^ 5));
    EXPECT_EQ(group.from_previous(group.thread()), group.lane() == 0 ? group.thread() : group.thread() - 1);
    out[group.block() * 64 + group.thread()] = other;
  }
};

TEST(HostExecution, CollectivesConnectThreads) {
  std::vector<int> out(128);
  HostBlock threads(64);
  run_on_host(threads, 2, ConnectThreads{out.data()});
  for (int i = 0; i < 128; ++i) EXPECT_EQ(out[static_cast<size_t>(i)], 63 - i % 64);
}

struct MissBarrier {
  static constexpr int kThreads = 64;
  using Shared = NoShared;
  void operator()(HostGroup& group, NoShared&) const {
    if (group.thread() != 5) group.sync();
  }
};

/// Lacks a barrier between the two accesses.
struct RaceThreads {
  static constexpr int kThreads = 64;
  struct Shared {
    int values[64];
  };
  int* out;
  void operator()(HostGroup& group, Shared& shared) const {
    shared.values[group.thread()] = 0;
    group.sync();
    shared.values[group.thread()] = 1;
    out[group.thread()] = shared.values[63 - group.thread()];
  }
};

TEST(HostExecution, ARaceShowsInAnotherOrder) {
  std::vector<int> forwards(64), backwards(64);
  HostBlock up(64), down(64, ThreadOrder::backwards);
  run_on_host(up, 1, RaceThreads{forwards.data()});
  run_on_host(down, 1, RaceThreads{backwards.data()});
  EXPECT_NE(forwards, backwards);
}

TEST(HostExecution, ABarrierThatSomeThreadNeverReachesIsAnError) {
  HostBlock threads(64);
  EXPECT_ANY_THROW(run_on_host(threads, 1, MissBarrier{}));
}

}  // namespace
}  // namespace photoslam::splatting::cuda

#endif  // __SANITIZE_THREAD__
