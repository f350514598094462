// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_view.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "photorealistic_mapping/world_export.h"
#include "pipeline/loaded_session.h"
#include "pipeline/system.h"
#include "pipeline/testing/corner_source.h"

namespace photoslam {
namespace {

using testing::CornerSource;

class SessionViewTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }

  RunOutcome walk(int start_at, int num_frames) {
    RunSettings settings;
    settings.deterministic = true;
    settings.session_file = folder / "session.photoslam";
    SystemOptions options;
    options.pipeline.iterations_per_frame = 1;
    CornerSource source(num_frames, 240, 180, SensorKind::rgbd);
    source.start_at = start_at;
    return run_slam(options, settings, source);
  }

  std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("photoslam-view-{}", ::getpid());
};

void expect_same(const Trajectory& a, const Trajectory& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].timestamp_ns, b[i].timestamp_ns);
    EXPECT_LT((a[i].world_from_camera.translation - b[i].world_from_camera.translation).norm(), 1e-9);
  }
}

void expect_same(const GaussianTable& a, const GaussianTable& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(std::ranges::equal(a.row(i), b.row(i))) << i;
}

TEST_F(SessionViewTest, ShowsWhatTheRunShowed) {
  const RunOutcome run = walk(0, 40);
  const auto view = view_session(folder);
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_EQ(view->camera, CornerSource(1, 240, 180, SensorKind::rgbd).info().camera);
  ASSERT_GT(view->keyframes.size(), 1u);
  expect_same(view->keyframes, keyframe_trajectory(run));
  ASSERT_GT(view->map.size(), 0u);
  expect_same(view->map, to_world(run.final.gaussians, run.final.anchors_from_world));
}

TEST_F(SessionViewTest, OfTwoMapsShowsTheLarger) {
  const RunOutcome large = walk(0, 60);
  LoadedSession one({}, *read_session(folder));
  ASSERT_GT(keyframe_trajectory(large).size(), keyframe_trajectory(walk(300, 10)).size());
  LoadedSession two({}, *read_session(folder));
  two.geometry.append(one.geometry);
  two.mapper.append(std::move(one.mapper));
  Archive both;
  both(two.header, two.geometry, two.mapper);
  ASSERT_TRUE(write_session(folder / "session.photoslam", both));

  const auto view = view_session(folder);
  ASSERT_TRUE(view) << view.error().message;
  expect_same(view->keyframes, keyframe_trajectory(large));
  expect_same(view->map, to_world(large.final.gaussians, large.final.anchors_from_world));
}

TEST_F(SessionViewTest, NamesWhatIsNoSession) {
  const auto view = view_session(folder / "nowhere.photoslam");
  ASSERT_FALSE(view);
  EXPECT_NE(view.error().message.find("nowhere.photoslam"), std::string::npos);
}

}  // namespace
}  // namespace photoslam
