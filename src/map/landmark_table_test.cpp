// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/landmark_table.h"

#include <gtest/gtest.h>

#include <map>

#include "base/random.h"

namespace photoslam {
namespace {

TEST(LandmarkTable, KnowsWhatAnOrderedMapKnows) {
  Random random(4);
  LandmarkTable table;
  std::map<LandmarkId, int> expected;
  for (int step = 0; step < 2000; ++step) {
    if (random.uniform() < 0.6) {
      const LandmarkId id = table.give_out(1);
      table.insert(id).times_found = step;
      expected[id] = step;
    } else if (table.size() > 0) {
      const LandmarkId any(random.index(static_cast<int>(table.size())));
      table.bury(any);
      expected.erase(any);
    }
  }
  ASSERT_GT(expected.size(), 100u);
  std::vector<LandmarkId> ids;
  for (const auto& [id, found] : expected) ids.push_back(id);
  EXPECT_EQ(table.living(), ids);
  for (int i = 0; i < static_cast<int>(table.size()); ++i) {
    const Landmark* landmark = table.find(LandmarkId(i));
    ASSERT_EQ(landmark != nullptr, expected.contains(LandmarkId(i)));
    if (landmark != nullptr) {
      EXPECT_EQ(landmark->times_found, expected[LandmarkId(i)]);
    }
  }
  EXPECT_EQ(table.find(LandmarkId{}), nullptr);
}

TEST(LandmarkTable, IdsAreNotGivenOutTwice) {
  LandmarkTable table;
  EXPECT_EQ(table.give_out(3), LandmarkId(0));
  table.insert(LandmarkId(2));
  table.bury(LandmarkId(2));
  EXPECT_EQ(table.give_out(1), LandmarkId(3));
  EXPECT_EQ(table.size(), 4u);
}

TEST(LandmarkTable, ForgetsTheOldestReplacements) {
  LandmarkTable table;
  const auto last = static_cast<int>(LandmarkTable::kMaxReplacements);
  table.give_out(LandmarkTable::kMaxReplacements + 2);
  for (int i = 0; i < last; ++i) EXPECT_FALSE(table.replace(LandmarkId(i), LandmarkId(i + 1)).valid());
  EXPECT_EQ(table.replacement(LandmarkId(0)), LandmarkId(1));
  EXPECT_EQ(table.replace(LandmarkId(last), LandmarkId(last + 1)), LandmarkId(0));
  EXPECT_FALSE(table.replacement(LandmarkId(0)).valid());
  EXPECT_EQ(table.replacement(LandmarkId(1)), LandmarkId(2));
  EXPECT_EQ(table.replaced().size(), LandmarkTable::kMaxReplacements);
  EXPECT_EQ(table.replaced().front(), LandmarkId(1));
}

}  // namespace
}  // namespace photoslam
