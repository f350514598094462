// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/check.h"

namespace photoslam {
namespace {

TEST(Statistics, DescribeByHand) {
  const Description d = describe({2, 4, 4, 4, 5, 5, 7, 9});
  EXPECT_DOUBLE_EQ(d.mean, 5);
  EXPECT_DOUBLE_EQ(d.standard_deviation, 2);
  EXPECT_EQ(d.min, 2);
  EXPECT_EQ(d.max, 9);
  EXPECT_EQ(describe({3}).standard_deviation, 0);
}

TEST(Statistics, PercentileInterpolatesBetweenRanks) {
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 0), 1);
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 1), 4);
  EXPECT_DOUBLE_EQ(percentile({40, 10, 30, 20, 50}, 0.05), 12);
  EXPECT_DOUBLE_EQ(percentile({7}, 0.99), 7);
  EXPECT_THROW(percentile({}, 0.5), CheckError);
}

}  // namespace
}  // namespace photoslam
