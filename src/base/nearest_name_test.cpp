// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/nearest_name.h"

#include <gtest/gtest.h>

#include <vector>

namespace photoslam {
namespace {

TEST(EditDistance, CountsSingleCharacterEdits) {
  EXPECT_EQ(edit_distance("", ""), 0);
  EXPECT_EQ(edit_distance("abc", ""), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("outptu", "output"), 1);  // neighbours swapped
  EXPECT_EQ(edit_distance("run", "rnu"), 1);
}

TEST(NearestName, FindsTheSlipOfTheFinger) {
  const std::vector<std::string> names = {"run", "eval", "render", "synth"};
  EXPECT_EQ(nearest_name("rnu", names), "run");
  EXPECT_EQ(nearest_name("rendr", names), "render");
  EXPECT_EQ(nearest_name("evaluate", names), "");
  EXPECT_EQ(nearest_name("x", names), "");
  EXPECT_EQ(nearest_name("run", {}), "");
}

}  // namespace
}  // namespace photoslam
