// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/html/time_plot.h"

#include <gmock/gmock.h>

namespace photoslam::html {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(RoundTicks, AreOneTwoOrFiveTimesAPowerOfTen) {
  EXPECT_THAT(round_ticks(0, 10, 5), ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(round_ticks(18.3, 31.9, 5), ElementsAre(20, 25, 30));
  EXPECT_THAT(round_ticks(0, 0.7, 5), ElementsAre(0, DoubleNear(0.2, 1e-12), 0.4, DoubleNear(0.6, 1e-12)));
  EXPECT_THAT(round_ticks(3, 3, 5), IsEmpty());
}

TEST(TimePlot, MapsValuesIntoTheFrameAndBreaksAtGaps) {
  TimePlot plot;
  plot.low = 0;
  plot.high = 100;
  plot.end_s = 10;
  plot.points = {{0, 0}, {1, 50}, {2, 1000}, {8, 100}, {9, 100}, {10, 100}};
  // Left end at 46, right end at 908, top 12, bottom 194; 1000 is cut off at the top.
  EXPECT_THAT(draw(plot), HasSubstr("d=\"M46.0 194.0L132.2 103.0L218.4 12.0M735.6 12.0L821.8 12.0L908.0 12.0\""));
  EXPECT_THAT(draw(plot), Not(HasSubstr("class=\"level\"")));
}

TEST(TimePlot, ShowsLevelAndMarks) {
  TimePlot plot;
  plot.level = 0.5;
  plot.level_label = "median <0.5>";
  plot.marks = {0.25, 0.75};
  const std::string svg = draw(plot);
  EXPECT_THAT(svg, HasSubstr("median &lt;0.5&gt;"));
  EXPECT_THAT(svg, HasSubstr("<path class=\"mark\" d=\"M261.5 194.0v-7\"/>"));
}

}  // namespace
}  // namespace photoslam::html
