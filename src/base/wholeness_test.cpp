// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/wholeness.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace photoslam {
namespace {

TEST(Wholeness, ChangesThatEndLeaveItWhole) {
  Wholeness wholeness;
  {
    const Wholeness::Change outer(wholeness, "a map");
    const Wholeness::Change inner(wholeness, "a map");
  }
  EXPECT_TRUE(wholeness.is_whole());
  EXPECT_NO_THROW(wholeness.check("a map"));
}

TEST(Wholeness, AnExceptionLeavesHalfOfAChangeForGood) {
  Wholeness wholeness;
  const auto fail = [&] {
    const Wholeness::Change change(wholeness, "a map");
    throw std::runtime_error("no memory");
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_FALSE(wholeness.is_whole());
  EXPECT_THROW(wholeness.check("a map"), CheckError);
  EXPECT_THROW(fail(), CheckError) << "no change begins any more";
}

TEST(Wholeness, AnExceptionThatIsCaughtInsideAChangeHarmsNothing) {
  Wholeness wholeness;
  {
    const Wholeness::Change change(wholeness, "a map");
    EXPECT_THROW(throw std::runtime_error("a detail"), std::runtime_error);
  }
  EXPECT_TRUE(wholeness.is_whole());
}

/// Changes something while an exception goes by.
struct Cleaner {
  Wholeness& wholeness;
  ~Cleaner() { const Wholeness::Change change(wholeness, "a map"); }
};

TEST(Wholeness, AChangeMadeWhileAnExceptionGoesByIsWhole) {
  Wholeness wholeness;
  const auto fail_elsewhere = [&] {
    const Cleaner cleaner{wholeness};
    throw std::runtime_error("elsewhere");
  };
  EXPECT_THROW(fail_elsewhere(), std::runtime_error);
  EXPECT_TRUE(wholeness.is_whole());
}

}  // namespace
}  // namespace photoslam
