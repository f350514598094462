// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/association.h"

#include <gmock/gmock.h>

namespace photoslam {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

TEST(AssociateTimes, TakesTheNearestWithinTheLimit) {
  const std::vector<int64_t> a = {0, 100, 200, 300}, b = {-15, 96, 119, 230, 305};
  EXPECT_THAT(associate_times(a, b, 20), ElementsAre(Pair(0, 0), Pair(1, 1), Pair(3, 4)));
  EXPECT_THAT(associate_times(a, b, 30), ElementsAre(Pair(0, 0), Pair(1, 1), Pair(2, 3), Pair(3, 4)));
  EXPECT_THAT(associate_times(a, {}, 30), IsEmpty());
  EXPECT_THAT(associate_times({}, b, 30), IsEmpty());
}

TEST(AssociateTimes, EachTimeIsUsedOnceByItsClosestPartner) {
  const std::vector<int64_t> a = {0, 8, 10}, b = {9, 11};
  // 8-9, 10-9 and 10-11 are equally close: the earlier goes first; 0 finds nobody left.
  EXPECT_THAT(associate_times(a, b, 20), ElementsAre(Pair(1, 0), Pair(2, 1)));
}

}  // namespace
}  // namespace photoslam
