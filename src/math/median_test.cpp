// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "math/median.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace photoslam {
namespace {

TEST(Median, IsTheMiddleOfTheSortedValues) {
  std::vector<int> odd = {5, 1, 9, 3, 7};
  EXPECT_EQ(lower_median(odd), 5);
  std::vector<double> even = {4.0, -1.0, 2.5, 8.0};
  EXPECT_EQ(lower_median(even), 2.5);
  std::vector<int> one = {3};
  EXPECT_EQ(lower_median(one), 3);
}

TEST(Median, OfNothingIsAProgrammersError) {
  std::vector<int> none;
  EXPECT_THROW(lower_median(none), std::logic_error);
}

}  // namespace
}  // namespace photoslam
