// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/bounded_queue.h"

#include <gtest/gtest.h>

#include <thread>

namespace photoslam {
namespace {

TEST(BoundedQueue, DropOldestKeepsTheNewestAndCounts) {
  BoundedQueue<int> queue(3, Overflow::drop_oldest);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(queue.push(i));
  EXPECT_EQ(queue.dropped(), 2u);
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), 3);
  EXPECT_EQ(queue.pop(), 4);
  EXPECT_EQ(queue.try_pop(), std::nullopt);
}

TEST(BoundedQueue, BlockDeliversEverythingInOrder) {
  BoundedQueue<int> queue(2, Overflow::block);
  std::jthread producer([&] {
    for (int i = 0; i < 1000; ++i) queue.push(i);
    queue.close();
  });
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(queue.pop(), i);
  EXPECT_EQ(queue.pop(), std::nullopt);
  EXPECT_EQ(queue.dropped(), 0u);
}

TEST(BoundedQueue, GrowLosesNothingAndWaitsForNobody) {
  BoundedQueue<int> queue(2, Overflow::grow);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(queue.push(i));
  EXPECT_EQ(queue.size(), 100u);
  EXPECT_EQ(queue.dropped(), 0u);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(queue.pop(), i);
}

TEST(BoundedQueue, WhatWaitsMayMakeWay) {
  BoundedQueue<int> queue(2, Overflow::block);
  const auto same_tens = [](int value, std::deque<int>& waiting) {
    if (!waiting.empty() && value / 10 == waiting.back() / 10) waiting.pop_back();
  };
  for (const int value : {11, 12, 21, 22, 23}) EXPECT_TRUE(queue.push(value, same_tens)) << "a full queue has room";
  EXPECT_EQ(queue.pop(), 12);
  EXPECT_EQ(queue.pop(), 23);
  EXPECT_TRUE(queue.push(24, same_tens)) << "there is nothing to remove";
  queue.close();
  EXPECT_FALSE(queue.push(25, same_tens));
  EXPECT_EQ(queue.pop(), 24);
}

TEST(BoundedQueue, CloseWakesABlockedProducerAndRefusesItsValue) {
  BoundedQueue<int> queue(1, Overflow::block);
  ASSERT_TRUE(queue.push(1));
  bool accepted = true;
  std::jthread producer([&] { accepted = queue.push(2); });
  queue.close();
  producer.join();
  EXPECT_FALSE(accepted);
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_TRUE(queue.finished());
}

}  // namespace
}  // namespace photoslam
