// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_merge.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "map/map_spacing.h"
#include "pipeline/loaded_session.h"
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
  /// Two walks that nobody has joined, in one session.
  std::string session_in_two_parts(int first_start, int second_start, int num_frames) {
    LoadedSession one({}, session(first_start, num_frames)), two({}, session(second_start, num_frames));
    one.geometry.append(two.geometry);
    one.mapper.append(std::move(two.mapper));
    Archive both;
    both(one.header, one.geometry, one.mapper);
    return both.bytes();
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

/// Where the gaussians of each keyframe are in its frame.
std::vector<std::vector<Vec3>> means_of_keyframes(const FrozenMap& map) {
  std::vector<std::vector<Vec3>> means(map.anchors_from_world.size());
  map.gaussians.for_each([&](size_t i) {
    const auto& mean = map.gaussians.get(i).mean;
    means[static_cast<size_t>(map.gaussians.anchor(i))].emplace_back(mean[0], mean[1], mean[2]);
  });
  return means;
}

TEST_F(SessionMergeTest, GaussiansStayWithTheKeyframesThatShowThem) {
  const RunOutcome one = walk(0, 60, SensorKind::rgbd);
  const std::string first = *read_session(folder);
  const RunOutcome two = walk(40, 60, SensorKind::rgbd);
  const std::string second = *read_session(folder);
  SystemOptions as_they_are;  // what was trained in either is only moved
  as_they_are.photorealistic_mapping.schedule.seam_uses = 0;
  as_they_are.photorealistic_mapping.doubling.enabled = false;
  const auto merged = merge_sessions(as_they_are, first, second, executor);
  ASSERT_TRUE(merged) << merged.error().message;

  auto expected = means_of_keyframes(one.final);
  for (auto& means : means_of_keyframes(two.final)) expected.push_back(std::move(means));
  const auto found = means_of_keyframes(merged->map);
  ASSERT_EQ(found.size(), expected.size());
  for (size_t k = 0; k < found.size(); ++k) EXPECT_TRUE(found[k] == expected[k]) << "keyframe " << k;
}

TEST_F(SessionMergeTest, PartsOfTheSecondThatMeetEachOtherOnlyAreNoMerge) {
  const std::string elsewhere = session(0, 20);
  const auto merged = merge_sessions({}, elsewhere, session_in_two_parts(300, 320, 60), executor);
  ASSERT_FALSE(merged);
  EXPECT_NE(merged.error().message.find("no place"), std::string::npos);
}

TEST_F(SessionMergeTest, AMapBegunLaterLiesBesideAllParts) {
  LoadedSession one({}, session(0, 20)), two({}, session(0, 20));
  // The part between them has been joined with the first.
  MapCorrection aside;
  aside.new_world_from_old_world.assign(two.geometry.map().num_keyframes(),
                                        Sim3(SE3(Quat::Identity(), Vec3(2 * kMapSpacing, 0, 0))));
  two.mapper.update_poses(*two.geometry.correct(aside));
  one.geometry.append(two.geometry);
  one.mapper.append(std::move(two.mapper));
  Archive both;
  both(one.header, one.geometry, one.mapper);

  RunSettings settings;
  settings.deterministic = true;
  settings.threads = 2;
  settings.loaded_session = std::make_shared<const std::string>(both.bytes());
  SystemOptions impatient;
  impatient.localization.recently_lost_s = 0.1;
  impatient.pipeline.iterations_per_frame = 0;
  CornerSource elsewhere(12);
  elsewhere.start_at = 300;
  const RunOutcome outcome = run_slam(impatient, settings, elsewhere);
  EXPECT_EQ(outcome.failure, "");
  const auto& poses = outcome.final.keyframes_from_world;
  const size_t num_old = one.geometry.map().num_keyframes();
  ASSERT_GT(poses.size(), num_old);
  for (size_t k = 0; k < num_old; ++k) {
    EXPECT_GT((poses.back().inverse().translation - poses[k].inverse().translation).norm(), 0.9 * kMapSpacing) << k;
  }
}

TEST_F(SessionMergeTest, MapsOfDifferentKeyframesAreRefused) {
  const std::string good = session(0, 20);
  LoadedSession few({}, good), many({}, session(0, 60));
  ASSERT_NE(few.mapper.num_keyframes(), many.mapper.num_keyframes());
  Archive torn;
  torn(many.header, many.geometry, few.mapper);
  const auto message = [&](const std::string& first, const std::string& second) {
    const auto merged = merge_sessions({}, first, second, executor);
    return merged ? std::string() : merged.error().message;
  };
  EXPECT_NE(message(torn.bytes(), good).find("first session"), std::string::npos);
  EXPECT_NE(message(good, torn.bytes()).find("second session cannot be continued: there are gaussians for"),
            std::string::npos);
}

TEST_F(SessionMergeTest, SessionsOfOtherSensorsAreRefused) {
  focal = CornerSource::kWide;
  const auto merged = merge_sessions({}, session(0, 20), session(0, 40, SensorKind::mono), executor);
  ASSERT_FALSE(merged);
  EXPECT_NE(merged.error().message.find("made with depth, this sensor measures none"), std::string::npos);
}

}  // namespace
}  // namespace photoslam
