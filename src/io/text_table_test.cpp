// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/text_table.h"

#include <gmock/gmock.h>

namespace photoslam {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(SplitTable, KeepsLineNumbersAndDropsComments) {
  const std::vector<TextLine> lines = split_table("# head\n\n1.5 a.png\r\n \t\nx,y\tz # rest\nlast");
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0].number, 3);
  EXPECT_THAT(lines[0].fields, ElementsAre("1.5", "a.png"));
  EXPECT_EQ(lines[1].number, 5);
  EXPECT_THAT(lines[1].fields, ElementsAre("x", "y", "z"));
  EXPECT_EQ(lines[2].number, 6);
  EXPECT_THAT(lines[2].fields, ElementsAre("last"));
  EXPECT_THAT(split_table(""), IsEmpty());
  EXPECT_THAT(split_table("\n\n#"), IsEmpty());
}

TEST(ParseNumber, TakesTheWholeTextOrNothing) {
  EXPECT_EQ(parse_number("-1.25e-3").value(), -1.25e-3);
  EXPECT_EQ(parse_number("+7").value(), 7);
  for (const char* text : {"", "-", "1,5", "1.5x", " 1", "nan", "inf", "1e999", "0x1p3"}) {
    EXPECT_FALSE(parse_number(text).ok()) << text;
  }
}

}  // namespace
}  // namespace photoslam
