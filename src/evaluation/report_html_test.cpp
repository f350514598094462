// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/report_html.h"

#include <gmock/gmock.h>

#include <cmath>
#include <regex>

#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::HasSubstr;
using testing::Not;

HtmlReport small_run() {
  HtmlReport content;
  content.title = "a <room>";
  content.notes = {"the depth scale is a guess"};
  for (int i = 0; i < 100; ++i) {
    const int64_t time = 5'000'000'000 + i * int64_t{33'333'333};
    const SE3 pose(Quat::Identity(), Vec3(std::cos(0.05 * i), 0, std::sin(0.05 * i)));
    content.truth.push_back({time, pose});
    content.estimate.push_back({time, SE3(pose.rotation, pose.translation + Vec3(0, 0.002, 0))});
    FrameRecord frame;
    frame.timestamp_ns = time;
    frame.state = i == 0 ? FrameState::initializing : FrameState::tracked;
    if (i == 0) frame.reason = "too <dark>";
    frame.tracking_ms = 12 + i % 5;
    content.frames.push_back(frame);
    content.scores.push_back({FrameId(i), time, 25 + 0.01 * i, 0.9});
  }
  content.pairs = {{"frame 3", ImageU8(32, 24, 3, 90), ImageU8(32, 24, 3, 100), content.scores[3]},
                   {"frame 60", ImageU8(32, 24, 1, 90), ImageU8(32, 24, 3, 100), content.scores[60]}};
  summarize(content.frames, content.report);
  content.report.ate.rmse_m = 0.00213;
  content.report.image = summarize(content.scores);
  content.report.mapping.gaussians = 1234567;
  content.report.config.all = {{"mapping.budget", 100000}, {"seed", 0}};
  return content;
}

size_t count(const std::string& text, const std::string& part) {
  size_t found = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

class HtmlReportTest : public TempFolderTest {
 protected:
  std::string write_and_read(const HtmlReport& content) const {
    EXPECT_TRUE(write_html_report(folder / "report.html", content).ok());
    return read_file(folder / "report.html").value();
  }
};

TEST_F(HtmlReportTest, StandsAlone) {
  const std::string page = write_and_read(small_run());
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("url(")));
  EXPECT_EQ(count(page, "src=\""), 4u);
  EXPECT_EQ(count(page, "src=\"data:image/jpeg;base64,"), 4u);
}

TEST_F(HtmlReportTest, ShowsFiguresCurvesAndPairs) {
  const std::string page = write_and_read(small_run());
  EXPECT_THAT(page, HasSubstr("<h1>a &lt;room&gt;</h1>"));
  EXPECT_THAT(page, HasSubstr("0.21<small>cm</small>"));
  EXPECT_THAT(page, HasSubstr("99<small></small></b><span>of 100 frames tracked"));
  EXPECT_THAT(page, HasSubstr("1\u202f234\u202f567"));
  EXPECT_THAT(page, HasSubstr("frame 60 · 25.60 dB · SSIM 0.900"));
  EXPECT_THAT(page, HasSubstr("nothing changed"));
  EXPECT_THAT(page, HasSubstr("Note: the depth scale is a guess"));
  EXPECT_THAT(page, HasSubstr("<td>too &lt;dark&gt;</td><td>1</td>"));
  EXPECT_EQ(count(page, "<svg class=\"plot\""), 3u);
  EXPECT_EQ(count(page, "<svg class=\"map\""), 1u);
  EXPECT_EQ(count(page, "class=\"mark\""), 1u) << "one frame without a pose";
}

TEST_F(HtmlReportTest, ShowsHowRefinementImprovesTheMap) {
  HtmlReport content = small_run();
  for (int i = 1; i <= 40; ++i) content.refinement.emplace_back(0.25 * i, 30 - 5.0 / i);
  const std::string page = write_and_read(content);
  EXPECT_EQ(count(page, "<svg class=\"plot\""), 4u);
  EXPECT_THAT(page, HasSubstr("while the map was refined"));
  EXPECT_THAT(page, HasSubstr("end 29.88"));
  EXPECT_THAT(page, HasSubstr(">10</text>")) << "the axis ends with the refinement, not with the input";
}

TEST_F(HtmlReportTest, IsWellFormed) {
  const std::string page = write_and_read(small_run());
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-z0-9]+)([^>]*)>");
  for (std::sregex_iterator it(page.begin(), page.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2], rest = (*it)[3];
    if (name == "meta" || name == "img" || rest.ends_with("/")) continue;
    if ((*it)[1].length() == 0) {
      open.push_back(name);
    } else {
      ASSERT_FALSE(open.empty()) << name;
      ASSERT_EQ(open.back(), name);
      open.pop_back();
    }
  }
  EXPECT_TRUE(open.empty());
}

TEST_F(HtmlReportTest, LeavesOutWhatIsNotThere) {
  const std::string page = write_and_read({});
  EXPECT_THAT(page, Not(HasSubstr("<svg")));
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_FALSE(write_html_report(folder / "absent" / "report.html", {}).ok());
}

}  // namespace
}  // namespace photoslam
