// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/sweep_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "base/random.h"

namespace photoslam::internal {
namespace {

TEST(FindBestPlane, IsTheFirstLeastAndAmbiguousWhenAnotherFarAwayIsAlmostAsGood) {
  Random random(3);
  int ambiguous = 0;
  for (int repetition = 0; repetition < 2000; ++repetition) {
    const int planes = kPlaneLanes * (1 + random.index(4));
    std::vector<int16_t> total;
    for (int k = 0; k < planes; ++k) total.push_back(static_cast<int16_t>(100 + random.index(200)));
    total[static_cast<size_t>(random.index(planes))] = static_cast<int16_t>(random.index(120));
    const auto margin = static_cast<int16_t>(random.index(40));

    const int best = static_cast<int>(std::ranges::min_element(total) - total.begin());
    bool expected = false;
    for (int k = 0; k < planes; ++k) {
      const auto difference = total[static_cast<size_t>(k)] - total[static_cast<size_t>(best)];
      expected = expected || (std::abs(k - best) > 2 && difference < margin);
    }
    const BestPlane found = find_best_plane(planes, total.data(), margin);
    ASSERT_EQ(found.plane, best);
    ASSERT_EQ(found.ambiguous, expected) << repetition;
    ambiguous += expected;
  }
  EXPECT_GT(ambiguous, 200);
  EXPECT_LT(ambiguous, 1800);
}

TEST(FindBestPlane, CostsNearTheirLargestDoNotWrapAround) {
  std::vector<int16_t> total(kPlaneLanes, 32766);
  total[5] = 32700;
  EXPECT_TRUE(find_best_plane(kPlaneLanes, total.data(), 100).ambiguous);
  EXPECT_FALSE(find_best_plane(kPlaneLanes, total.data(), 60).ambiguous);
}

}  // namespace
}  // namespace photoslam::internal
