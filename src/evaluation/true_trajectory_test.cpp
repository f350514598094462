// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/true_trajectory.h"

#include "io/temp_folder_test.h"
#include "pipeline/frame_rectifier.h"
#include "sources/open_source.h"
#include "sources/synthetic/room.h"
#include "sources/synthetic/sensor_model.h"
#include "sources/synthetic/sequence_writer.h"

namespace photoslam {
namespace {

using TrueTrajectoryTest = TempFolderTest;

/// Mean difference in grey levels where the camera has data.
double difference(const ImageU8& a, const ImageU8& b, const ImageU8& mask) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      if (mask(x, y) == 0) continue;
      for (int c = 0; c < 3; ++c) sum += std::abs(a(x, y, c) - b(x, y, c));
      count += 3;
    }
  }
  return sum / count;
}

TEST_F(TrueTrajectoryTest, IsWhereTheRectifiedPicturesOfATurnedRigWereTaken) {
  ThreadPool pool(2);
  const auto room = std::make_shared<const SyntheticRoom>(1, pool, SceneQuality::draft);
  SyntheticOptions options;
  options.sensor = SensorKind::stereo;
  options.num_frames = 3;
  options.frames_per_second = 2;
  options.camera = {.width = 160, .height = 120, .fx = 131, .fy = 130, .cx = 81, .cy = 58};
  options.distortion = {-0.28, 0.07, 0.0002, -0.0003};
  options.image_noise = 0;
  const SyntheticCamera camera(room, options);
  ASSERT_TRUE(write_sequence(camera, {SequenceLayout::euroc, true}, folder / "rig", pool).ok());

  const auto source = open_source(folder / "rig").value();
  const FrameRectifier rectifier(source->info());
  const Trajectory left = read_ground_truth(folder / "rig").value();
  const Trajectory truth = read_true_trajectory(folder / "rig", source->info()).value();
  ASSERT_EQ(truth.size(), 3u);
  for (size_t i = 0; i < truth.size(); ++i) {
    const ImageU8 picture = rectifier.color(source->next().value().color);
    const auto seen_from = [&](const SE3& world_from_camera) {
      return difference(picture, expose(room->render(world_from_camera, rectifier.camera(), pool), 0, 0, 0),
                        rectifier.mask());
    };
    const double turned = seen_from(left[i].world_from_camera);
    EXPECT_LT(seen_from(truth[i].world_from_camera), 0.35 * turned) << i << ": as mounted " << turned;
    EXPECT_LT((truth[i].world_from_camera.translation - left[i].world_from_camera.translation).norm(), 1e-12);
  }
  SourceInfo mono = source->info();
  mono.sensor = SensorKind::mono;
  EXPECT_EQ(of_tracked_camera(left, mono)[1].world_from_camera.matrix(), left[1].world_from_camera.matrix())
      << "a single camera is tracked as it is mounted";
}

}  // namespace
}  // namespace photoslam
