// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/synthetic_source.h"

#include <gtest/gtest.h>

#include "io/image_file.h"
#include "io/temp_folder_test.h"
#include "sources/ground_truth.h"
#include "sources/open_source.h"
#include "sources/synthetic/room.h"
#include "sources/synthetic/room_trajectory.h"
#include "sources/synthetic/sequence_writer.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

SyntheticOptions small_options() {
  SyntheticOptions options;
  options.num_frames = 5;
  options.camera = {.width = 96, .height = 72, .fx = 78.5, .fy = 78.25, .cx = 49.125, .cy = 34.5};
  options.exposure_drift = 0.5;
  return options;
}

std::shared_ptr<const SyntheticRoom> draft_room(Executor& executor) {
  return std::make_shared<const SyntheticRoom>(1, executor, SceneQuality::draft);
}

TEST(SyntheticSource, DeliversTheSameFramesAtAnyThreadCount) {
  SerialExecutor serial;
  ThreadPool pool(2);
  const SyntheticOptions options = small_options();
  const auto room = draft_room(pool);
  SyntheticSource one(room, options, serial), two(room, options, pool);
  EXPECT_EQ(one.info().camera, options.camera);
  EXPECT_EQ(one.info().num_frames, 5);
  const Trajectory truth = SyntheticCamera(room, options).ground_truth();
  ASSERT_EQ(truth.size(), 5u);
  const int64_t times[] = {0, 33333333, 66666666, 100000000, 133333333};
  const RoomTrajectory path(1, options.seconds_per_lap);
  ImageU8 before;
  for (int i = 0; i < 5; ++i) {
    const std::optional<Frame> a = one.next(), b = two.next();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->id, FrameId(i));
    EXPECT_TRUE(a->defect.empty());
    EXPECT_EQ(a->timestamp_ns, times[i]);
    EXPECT_EQ(truth[static_cast<size_t>(i)].timestamp_ns, times[i]);
    const SE3 pose = path.world_from_camera(static_cast<double>(times[i]) * 1e-9);
    EXPECT_EQ(truth[static_cast<size_t>(i)].world_from_camera.matrix(), pose.matrix());
    EXPECT_EQ(a->color, b->color);
    EXPECT_EQ(a->depth, b->depth);
    EXPECT_NE(a->color, before);
    before = a->color;
  }
  EXPECT_FALSE(one.next().has_value());
}

TEST(SyntheticSource, FilmsAlongAGivenPathToo) {
  ThreadPool pool(2);
  const SyntheticOptions options = small_options();
  const auto room = draft_room(pool);
  const SyntheticCamera usual(room, options);
  // The end of the usual walk, from its third frame on.
  Trajectory poses = usual.ground_truth();
  poses.erase(poses.begin(), poses.begin() + 2);
  const SyntheticCamera given(room, options, std::make_unique<RecordedPath>(poses));
  EXPECT_EQ(given.world_from_camera(0).matrix(), usual.world_from_camera(2).matrix());
  EXPECT_EQ(given.view(0, pool).radiance, usual.view(2, pool).radiance);
  EXPECT_EQ(given.world_from_camera(4).matrix(), usual.world_from_camera(4).matrix()) << "rests at its end";
}

class SequenceWriterTest : public TempFolderTest {
 protected:
  /// Reads a written sequence with the reader of real ones and compares it with the frames themselves.
  void expect_readable(const fs::path& path, const SyntheticCamera& camera, double metres_per_unit, bool lossless) {
    SerialExecutor serial;
    const auto source = open_source(path);
    ASSERT_TRUE(source.ok()) << source.error().message;
    EXPECT_EQ((*source)->info().camera, camera.options().camera);
    EXPECT_TRUE((*source)->info().distortion.none());
    EXPECT_DOUBLE_EQ((*source)->info().metres_per_depth_unit, metres_per_unit);
    for (int i = 0; i < camera.options().num_frames; ++i) {
      const std::optional<Frame> read = (*source)->next();
      ASSERT_TRUE(read.has_value());
      ASSERT_EQ(read->defect, "");
      const Frame made = camera.sense(i, camera.view(i, serial), metres_per_unit, serial);
      EXPECT_EQ(read->timestamp_ns, made.timestamp_ns);
      EXPECT_EQ(read->depth, made.depth);
      if (lossless) {
        EXPECT_EQ(read->color, made.color);
      }
      double error = 0;
      for (size_t k = 0; k < made.color.values().size(); ++k) {
        error += std::abs(read->color.values()[k] - made.color.values()[k]);
      }
      EXPECT_LT(error / static_cast<double>(made.color.values().size()), 6.0);
    }
    EXPECT_FALSE((*source)->next().has_value());
    const auto file = find_ground_truth(path);
    ASSERT_TRUE(file.has_value());
    const auto truth = read_ground_truth(*file);
    ASSERT_TRUE(truth.ok()) << truth.error().message;
    ASSERT_EQ(truth->size(), static_cast<size_t>(camera.options().num_frames));
    for (int i = 0; i < camera.options().num_frames; ++i) {
      const SE3 difference = (*truth)[static_cast<size_t>(i)].world_from_camera.inverse() * camera.world_from_camera(i);
      EXPECT_LT(difference.log().norm(), 1e-8);
      EXPECT_EQ((*truth)[static_cast<size_t>(i)].timestamp_ns, camera.timestamp_ns(i));
    }
  }
};

TEST_F(SequenceWriterTest, WrittenSequencesReadBack) {
  ThreadPool pool(2);
  const SyntheticCamera camera(draft_room(pool), small_options());
  int calls = 0;
  const auto count = [&](int done) { EXPECT_EQ(done, ++calls); };
  const auto tum = write_sequence(camera, {SequenceLayout::tum, true}, folder / "tum/", pool, count);
  ASSERT_TRUE(tum.ok()) << tum.error().message;
  EXPECT_EQ(tum->frames, 5);
  EXPECT_EQ(calls, 5);
  EXPECT_GT(tum->detail.horizontal_difference, 1);
  expect_readable(folder / "tum", camera, 1 / 5000.0, true);

  ASSERT_TRUE(write_sequence(camera, {SequenceLayout::tum, false}, folder / "compressed", pool).ok());
  expect_readable(folder / "compressed", camera, 1 / 5000.0, false);
  ASSERT_TRUE(write_sequence(camera, {SequenceLayout::replica, false}, folder / "replica", pool).ok());
  expect_readable(folder / "replica", camera, 1 / 6553.5, false);
}

TEST_F(SequenceWriterTest, WrittenRigsReadBack) {
  ThreadPool pool(2);
  SerialExecutor serial;
  SyntheticOptions options = small_options();
  options.num_frames = 3;
  const auto room = draft_room(pool);
  const auto expect_same = [&](SequenceLayout layout, const char* name) {
    const SyntheticCamera camera(room, options);
    const auto written = write_sequence(camera, {layout, true}, folder / name, pool);
    ASSERT_TRUE(written.ok()) << written.error().message;
    const auto source = open_source(folder / name).value();
    const SourceInfo &made = camera.info(), &read = source->info();
    EXPECT_EQ(read.sensor, options.sensor);
    EXPECT_EQ(read.camera, made.camera);
    EXPECT_EQ(read.distortion, made.distortion);
    ASSERT_EQ(read.right.has_value(), made.right.has_value());
    if (made.right) {
      EXPECT_EQ(read.right->camera, made.right->camera);
      EXPECT_EQ(read.right->distortion, made.right->distortion);
      EXPECT_LT((read.right->right_from_left.inverse() * made.right->right_from_left).log().norm(), 1e-9);
    }
    const Trajectory truth = read_ground_truth(folder / name).value();
    for (int i = 0; i < 3; ++i) {
      const Frame a = source->next().value(), b = camera.frame(i, serial);
      EXPECT_EQ(a.defect, "");
      EXPECT_EQ(a.timestamp_ns, b.timestamp_ns);
      EXPECT_EQ(a.color, b.color);
      EXPECT_EQ(a.right, b.right);
      const StampedPose& pose = truth[static_cast<size_t>(i)];
      EXPECT_EQ(pose.timestamp_ns, b.timestamp_ns);
      EXPECT_LT((pose.world_from_camera.inverse() * camera.world_from_camera(i)).log().norm(), 1e-8);
    }
  };
  options.sensor = SensorKind::stereo;
  expect_same(SequenceLayout::kitti, "kitti");
  options.distortion = {-0.28, 0.07, 0.0002, -0.0003};
  expect_same(SequenceLayout::euroc, "euroc");
  EXPECT_FALSE(check_layout(SequenceLayout::kitti, options).ok());
  EXPECT_FALSE(check_layout(SequenceLayout::tum, options).ok());
  options.sensor = SensorKind::mono;
  options.distortion = {.k1 = 0.004, .k2 = 0.002, .k3 = -0.003, .k4 = 0.0005, .model = LensModel::kannala_brandt};
  expect_same(SequenceLayout::euroc, "euroc-mono");
  expect_same(SequenceLayout::tum, "tum-mono");
  EXPECT_FALSE(check_layout(SequenceLayout::replica, options).ok());
}

TEST_F(SequenceWriterTest, LeavesNothingBehindWhenItCannotFinish) {
  ThreadPool pool(2);
  const SyntheticCamera camera(draft_room(pool), small_options());
  const fs::path used = write("used/note.txt", "mine").parent_path();
  const auto refused = write_sequence(camera, {}, used, pool);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find(used.string()), std::string::npos);

  std::stop_source stop;
  const auto stopped = write_sequence(
      camera, {}, folder / "stopped", pool,
      [&](int done) {
        if (done == 2) stop.request_stop();
      },
      stop.get_token());
  EXPECT_FALSE(stopped.ok());
  EXPECT_FALSE(write_sequence(camera, {}, used / "note.txt" / "below", pool).ok());
  EXPECT_FALSE(check_sequence_folder(used / "note.txt" / "below" / "more").ok());
  EXPECT_TRUE(check_sequence_folder(folder / "new" / "one").ok());

  // Only what was there before.
  EXPECT_TRUE(fs::exists(used / "note.txt"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
  EXPECT_EQ(std::distance(fs::directory_iterator(used), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace photoslam
