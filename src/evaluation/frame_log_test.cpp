// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/frame_log.h"

#include <gmock/gmock.h>

#include "io/temp_folder_test.h"

namespace photoslam {
namespace {

using testing::HasSubstr;

class FrameLogTest : public TempFolderTest {};

TEST_F(FrameLogTest, ReadsWhatItWrote) {
  FrameRecord tracked{.frame = FrameId(0),
                      .timestamp_ns = 1305031102175304000,
                      .state = FrameState::tracked,
                      .reason = "",
                      .inliers = 213,
                      .active_ratio = 0.5,
                      .queue_wait_ms = 0.25,
                      .tracking_ms = 12.5,
                      .blocked_ms = 0.125,
                      .latency_ms = 14,
                      .keyframe = KeyframeId(3)};
  FrameRecord lost{.frame = FrameId(1),
                   .timestamp_ns = -5,
                   .state = FrameState::lost,
                   .reason = "rgb/1,0.png: \"damaged\"\nPNG",
                   .inliers = 0,
                   .active_ratio = {},
                   .queue_wait_ms = {},
                   .tracking_ms = {},
                   .blocked_ms = {},
                   .latency_ms = {},
                   .keyframe = {}};
  ASSERT_TRUE(write_frame_log(folder / "frames.csv", {tracked, lost}).ok());
  const FrameLog log = read_frame_log(folder / "frames.csv").value();
  ASSERT_EQ(log.size(), 2u);
  EXPECT_EQ(log[0].timestamp_ns, tracked.timestamp_ns);
  EXPECT_EQ(log[0].state, FrameState::tracked);
  EXPECT_EQ(log[0].inliers, 213);
  EXPECT_EQ(log[0].active_ratio, 0.5);
  EXPECT_EQ(log[0].queue_wait_ms, 0.25);
  EXPECT_EQ(log[0].tracking_ms, 12.5);
  EXPECT_EQ(log[0].blocked_ms, 0.125);
  EXPECT_EQ(log[0].latency_ms, 14);
  EXPECT_EQ(log[0].keyframe, KeyframeId(3));
  EXPECT_EQ(log[1].frame, FrameId(1));
  EXPECT_EQ(log[1].timestamp_ns, -5);
  EXPECT_EQ(log[1].reason, "rgb/1,0.png: \"damaged\" PNG");
  EXPECT_FALSE(log[1].tracking_ms.has_value());
  EXPECT_FALSE(log[1].keyframe.valid());
}

TEST_F(FrameLogTest, EveryStateHasItsName) {
  FrameLog log;
  for (const FrameState state :
       {FrameState::tracked, FrameState::coasted, FrameState::initializing, FrameState::lost, FrameState::dropped}) {
    log.emplace_back().state = state;
  }
  ASSERT_TRUE(write_frame_log(folder / "frames.csv", log).ok());
  const FrameLog back = read_frame_log(folder / "frames.csv").value();
  for (size_t i = 0; i < log.size(); ++i) EXPECT_EQ(back[i].state, log[i].state);
}

TEST_F(FrameLogTest, ErrorsNameTheLine) {
  ASSERT_TRUE(write_frame_log(folder / "frames.csv", FrameLog(2)).ok());
  const std::string good = read_file(folder / "frames.csv").value();
  const auto failure = [&](std::string_view content) {
    return read_frame_log(write("bad.csv", content)).error().message;
  };
  EXPECT_THAT(failure("time,state\n"), HasSubstr("bad.csv:1: expected the header"));
  EXPECT_THAT(failure(good + "1,2\n"), HasSubstr("bad.csv:4: expected 11 fields, found 2"));
  EXPECT_THAT(failure(good + "x,2,lost,,0,,,,,,\n"), HasSubstr("bad.csv:4: 'x' is not a whole number"));
  EXPECT_THAT(failure(good + "1,then,lost,,0,,,,,,\n"), HasSubstr("bad.csv:4: 'then' is not a time"));
  EXPECT_THAT(failure(good + "1,2,happy,,0,,,,,,\n"), HasSubstr("bad.csv:4: 'happy' is not a state"));
  EXPECT_THAT(failure(good + "1,2,lost,,0,,,slow,,,\n"), HasSubstr("bad.csv:4: 'slow' is not a number"));
}

}  // namespace
}  // namespace photoslam
