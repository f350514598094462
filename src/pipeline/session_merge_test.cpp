// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_merge.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "pipeline/session_file.h"
#include "pipeline/system.h"
#include "pipeline/testing/corner_source.h"

namespace photoslam {
namespace {

using testing::CornerSource;

class SessionMergeTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }

  /// Walks from a frame on, in a world of its own, or in that of a session.
  RunOutcome walk(int start_at, int num_frames, SensorKind sensor,
                  std::shared_ptr<const std::string> loaded = nullptr) {
    RunSettings settings;
    settings.deterministic = true;
    settings.threads = 2;
    settings.session_file = folder / "session.photoslam";
    settings.localize_only = loaded != nullptr;
    settings.loaded_session = std::move(loaded);
    SystemOptions options;
    options.pipeline.iterations_per_frame = 1;
    CornerSource source(num_frames, 240, 180, sensor, focal);
    source.start_at = start_at;
    return run_slam(options, settings, source);
  }
  double focal = 0.85;  // [image widths]
  std::string session(int start_at, int num_frames, SensorKind sensor = SensorKind::rgbd) {
    EXPECT_EQ(walk(start_at, num_frames, sensor).failure, "");
    return *read_session(folder);
  }

  std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("photoslam-merge-{}", ::getpid());
  ThreadPool executor{2};
};

TEST_F(SessionMergeTest, BringsTwoWalksIntoOneWorld) {
  const std::string first = session(0, 60), second = session(40, 60);
  const auto merged = merge_sessions({}, first, second, executor);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_GE(merged->num_loops, 1);
  ASSERT_GT(merged->map.keyframes_from_world.size(), static_cast<size_t>(merged->num_keyframes_of_first));
  EXPECT_EQ(merged->component_of_keyframe, std::vector<int>(merged->map.keyframes_from_world.size(), 0));

  // The first keyframe of either is the first frame of its walk.
  const auto joint = static_cast<size_t>(merged->num_keyframes_of_first);
  const SE3 estimate = merged->map.keyframes_from_world[joint] * merged->map.keyframes_from_world[0].inverse();
  const SE3 truth = CornerSource::camera_from_world(40) * CornerSource::camera_from_world(0).inverse();
  EXPECT_LT((estimate * truth.inverse()).translation.norm(), 0.02);

  // Frames of both walks are found in the map of both.
  const auto bytes = std::make_shared<const std::string>(merged->session.bytes());
  for (const int place : {5, 80}) {
    const RunOutcome found = walk(place, 12, SensorKind::rgbd, bytes);
    EXPECT_EQ(found.failure, "");
    const auto pose = camera_from_world(found.frames.back(), found.final);
    ASSERT_TRUE(pose.has_value()) << place;
    const SE3 to_first = CornerSource::camera_from_world(place + 11) * CornerSource::camera_from_world(0).inverse();
    EXPECT_LT((*pose * to_first.inverse()).translation.norm(), 0.03) << place;
  }
}

TEST_F(SessionMergeTest, MapsThatShowDifferentPlacesStayApart) {
  const auto merged = merge_sessions({}, session(0, 20), session(300, 20), executor);
  ASSERT_FALSE(merged);
  EXPECT_NE(merged.error().message.find("no place"), std::string::npos);
}

TEST_F(SessionMergeTest, SessionsOfOtherSensorsAreRefused) {
  focal = CornerSource::kWide;
  const auto merged = merge_sessions({}, session(0, 20), session(0, 40, SensorKind::mono), executor);
  ASSERT_FALSE(merged);
  EXPECT_NE(merged.error().message.find("made with depth, this sensor measures none"), std::string::npos);
}

}  // namespace
}  // namespace photoslam
