// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/system.h"

#include <gtest/gtest.h>

#include <cstring>

#include "math/umeyama.h"
#include "pipeline/frame_rectifier.h"
#include "pipeline/testing/corner_source.h"
#include "splatting/cuda/engine.h"
#include "splatting/cuda/host_device.h"
#include "splatting/gpu.h"

namespace photoslam {
namespace {

using testing::CornerSource;

RunSettings deterministic(int threads) {
  RunSettings settings;
  settings.deterministic = true;
  settings.threads = threads;
  return settings;
}

RunOutcome run(CornerSource source, const RunSettings& settings) {
  SystemOptions options;
  options.pipeline.iterations_per_frame = 2;
  return run_slam(options, settings, source);
}

void expect_same_bytes(const RunOutcome& a, const RunOutcome& b) {
  const Trajectory ta = final_trajectory(a), tb = final_trajectory(b);
  ASSERT_EQ(ta.size(), tb.size());
  for (size_t i = 0; i < ta.size(); ++i) {
    EXPECT_EQ(ta[i].world_from_camera.translation, tb[i].world_from_camera.translation) << i;
    EXPECT_EQ(ta[i].world_from_camera.rotation.coeffs(), tb[i].world_from_camera.rotation.coeffs()) << i;
  }
  ASSERT_EQ(a.final.gaussians.size(), b.final.gaussians.size());
  a.final.gaussians.for_each([&](size_t i) {
    const splatting::Gaussian ga = a.final.gaussians.get(i), gb = b.final.gaussians.get(i);
    EXPECT_EQ(std::memcmp(&ga, &gb, sizeof ga), 0) << i;
  });
}

TEST(RunSlam, DeterministicRunsGiveTheSameBytesAtAnyNumberOfThreads) {
  const RunOutcome one = run(CornerSource(40), deterministic(1));
  EXPECT_GT(one.final.gaussians.size(), 200u);
  EXPECT_GE(one.final.keyframes_from_world.size(), 2u);
  expect_same_bytes(one, run(CornerSource(40), deterministic(2)));
  expect_same_bytes(one, run(CornerSource(40), deterministic(3)));
}

TEST(RunSlam, TracksAnExactSequenceClosely) {
  const RunOutcome outcome = run(CornerSource(40), deterministic(2));
  ASSERT_EQ(outcome.frames.size(), 40u);
  for (const FrameOutcome& frame : outcome.frames) {
    ASSERT_TRUE(frame.has_pose) << frame.frame.value << ": " << frame.reason;
    const SE3 truth = CornerSource::camera_from_world(frame.frame.value);  // the first pose is the identity in both
    const SE3 error = camera_from_world(frame, outcome.final).value() * truth.inverse();
    // The camera has 240x180 pixels: at 3 m one of them is 15 mm wide.
    EXPECT_LT(error.translation.norm(), 0.03) << "frame " << frame.frame.value;
  }
}

#ifndef __SANITIZE_THREAD__  // it does not know fibers
TEST(RunSlam, GoesOnWhenTheGpuIsLost) {
  using splatting::cuda::HostDevice;
  splatting::cuda::HostFaults faults;
  faults.lost = [calls = 0]() mutable { return ++calls > 200; };  // after a few iterations
  RunSettings settings = deterministic(1);
  settings.gpu = std::make_shared<splatting::Gpu>(
      std::make_unique<splatting::cuda::Engine<HostDevice>>(HostDevice(splatting::cuda::ThreadOrder::forwards, &faults),
                                                            uint64_t{1} << 30),
      "host");
  const RunOutcome outcome = run(CornerSource(20), settings);
  EXPECT_NE(settings.gpu->failure(), "");
  EXPECT_EQ(outcome.failure, "");
  for (const FrameOutcome& frame : outcome.frames) EXPECT_TRUE(frame.has_pose) << frame.frame.value;
  EXPECT_GT(outcome.final.gaussians.size(), 200u);
  ASSERT_TRUE(outcome.gpu.has_value());
  EXPECT_GT(outcome.gpu->peak_mb, 0);
  EXPECT_GT(outcome.gpu->busy_seconds, 0);
  EXPECT_LT(outcome.gpu->busy_seconds, outcome.seconds_online + outcome.seconds_drain);
  const RunOutcome without = run(CornerSource(20), deterministic(1));
  EXPECT_EQ(outcome.iterations, without.iterations);
  EXPECT_FALSE(without.gpu.has_value());
}
#endif

#ifndef __SANITIZE_THREAD__
/// A short walk of a stereo rig with lenses that distort, on a GPU that is lost after so many of its calls.
RunOutcome run_with_gpu(int calls_until_lost) {
  using splatting::cuda::HostDevice;
  splatting::cuda::HostFaults faults;
  faults.lost = [calls = 0, calls_until_lost]() mutable { return ++calls > calls_until_lost; };
  RunSettings settings = deterministic(1);
  settings.gpu = std::make_shared<splatting::Gpu>(
      std::make_unique<splatting::cuda::Engine<HostDevice>>(HostDevice(splatting::cuda::ThreadOrder::forwards, &faults),
                                                            uint64_t{1} << 30),
      "host");
  return run(CornerSource(4, 160, 120, SensorKind::stereo), settings);
}

TEST(RunSlam, TracksTheSameWhoeverUndistorts) {
  const RunOutcome without = run(CornerSource(4, 160, 120, SensorKind::stereo), deterministic(1));
  for (const int calls_until_lost : {1 << 30, 20, 1}) {
    const RunOutcome outcome = run_with_gpu(calls_until_lost);
    ASSERT_TRUE(outcome.gpu.has_value());
    EXPECT_EQ(outcome.gpu->undistortion_failure.empty(), calls_until_lost == 1 << 30);
    ASSERT_EQ(outcome.frames.size(), without.frames.size());
    for (size_t i = 0; i < without.frames.size(); ++i) {
      const FrameOutcome &got = outcome.frames[i], &want = without.frames[i];
      ASSERT_TRUE(want.has_pose) << i << ": " << want.reason;
      EXPECT_EQ(got.num_features, want.num_features) << i;
      EXPECT_EQ(got.num_inliers, want.num_inliers) << i;
      EXPECT_EQ(got.online_camera_from_world.translation, want.online_camera_from_world.translation) << i;
    }
  }
}
#endif

TEST(RunSlam, TracksADistortedStereoRig) {
  const CornerSource source(40, 320, 240, SensorKind::stereo);
  const Quat rectified_from_left = FrameRectifier(source.info()).rectified_from_left();
  const RunOutcome outcome = run(source, deterministic(2));
  ASSERT_EQ(outcome.frames.size(), 40u);
  for (const FrameOutcome& frame : outcome.frames) {
    ASSERT_TRUE(frame.has_pose) << frame.frame.value << ": " << frame.reason;
    // Both worlds are the first camera's, one of them rectified.
    const SE3 turn(rectified_from_left, Vec3::Zero());
    const SE3 truth = turn * CornerSource::camera_from_world(frame.frame.value) * turn.inverse();
    const SE3 error = camera_from_world(frame, outcome.final).value() * truth.inverse();
    // At 3 m, a pixel of disparity is 30 cm of depth; there are hundreds of features with a tenth of that.
    EXPECT_LT(error.translation.norm(), 0.03) << "frame " << frame.frame.value;
  }
}

TEST(RunSlam, TracksASingleCameraUpToScale) {
  const RunOutcome outcome = run(CornerSource(60, 320, 240, SensorKind::mono, CornerSource::kWide), deterministic(2));
  ASSERT_EQ(outcome.frames.size(), 60u);
  std::vector<Vec3> estimate, truth;
  for (const FrameOutcome& frame : outcome.frames) {
    if (estimate.empty() && !frame.has_pose) continue;
    ASSERT_TRUE(frame.has_pose) << frame.frame.value << ": " << frame.reason;
    estimate.push_back(camera_from_world(frame, outcome.final).value().inverse().translation);
    truth.push_back(CornerSource::camera_from_world(frame.frame.value).inverse().translation);
  }
  EXPECT_GT(estimate.size(), 35u) << "initialised late";
  const Sim3 truth_from_estimate = align_umeyama(estimate, truth, true);
  for (size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT((truth_from_estimate * estimate[i] - truth[i]).norm(), 0.03) << i;
  }
}

TEST(RunSlam, DeterministicRunsOfASingleCameraGiveTheSameBytes) {
  const RunOutcome one = run(CornerSource(45, 320, 240, SensorKind::mono, CornerSource::kWide), deterministic(1));
  EXPECT_GE(one.final.keyframes_from_world.size(), 2u);
  expect_same_bytes(one, run(CornerSource(45, 320, 240, SensorKind::mono, CornerSource::kWide), deterministic(2)));
}

TEST(RunSlam, RealTimePaceAccountsForEveryFrame) {
  RunSettings settings;
  CornerSource source(20);
  const RunOutcome outcome = run_slam({}, settings, source);
  ASSERT_EQ(outcome.frames.size(), 20u);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(outcome.frames[static_cast<size_t>(i)].frame, FrameId(i));
  EXPECT_GE(outcome.seconds_online, 19 / 30.0);
  EXPECT_TRUE(outcome.failure.empty()) << outcome.failure;
}

TEST(RunSlam, HeldOutFramesAreTrackedButNeverMapped) {
  RunSettings settings = deterministic(2);
  settings.hold_out = 4;
  const RunOutcome outcome = run(CornerSource(30), settings);
  int held_out = 0;
  for (const FrameOutcome& frame : outcome.frames) {
    EXPECT_EQ(frame.held_out, frame.frame.value % 4 == 3);
    if (!frame.held_out) continue;
    ++held_out;
    EXPECT_TRUE(frame.has_pose);
    EXPECT_FALSE(frame.keyframe.valid());
  }
  EXPECT_EQ(held_out, 7);
}

TEST(RunSlam, AnUnreadableFrameIsCountedAndSkipped) {
  CornerSource source(15);
  source.defect_at = 6;
  const RunOutcome outcome = run(std::move(source), deterministic(2));
  ASSERT_EQ(outcome.frames.size(), 15u);
  EXPECT_FALSE(outcome.frames[6].has_pose);
  EXPECT_EQ(outcome.frames[6].reason, "unreadable");
  EXPECT_TRUE(outcome.frames[7].has_pose) << outcome.frames[7].reason;
}

TEST(RunSlam, FramesThatTheCameraHasDroppedAreCounted) {
  for (const int threads : {1, 2}) {
    CornerSource source(12);
    source.gap_at = 6;
    source.gap = 3;
    const RunOutcome outcome = run(std::move(source), deterministic(threads));
    EXPECT_EQ(outcome.failure, "");
    ASSERT_EQ(outcome.frames.size(), 15u);
    for (int i = 0; i < 15; ++i) {
      const FrameOutcome& frame = outcome.frames[static_cast<size_t>(i)];
      EXPECT_EQ(frame.frame, FrameId(i));
      EXPECT_EQ(frame.dropped, i >= 6 && i < 9) << i;
      EXPECT_EQ(frame.has_pose, !frame.dropped) << i;
      if (i > 0) {
        EXPECT_GT(frame.timestamp_ns, outcome.frames[static_cast<size_t>(i - 1)].timestamp_ns) << i;
      }
    }
    EXPECT_EQ(outcome.frames[7].reason, "dropped by the camera");
  }
}

TEST(RunSlam, AFailingSourceEndsTheRunWithEverythingMadeSoFar) {
  for (int threads : {1, 2}) {
    CornerSource source(30);
    source.throw_at = 12;
    const RunOutcome outcome = run(std::move(source), deterministic(threads));
    EXPECT_NE(outcome.failure.find("the cable was pulled"), std::string::npos) << outcome.failure;
    EXPECT_EQ(outcome.frames.size(), 12u);
    EXPECT_GT(outcome.final.gaussians.size(), 0u);
  }
}

TEST(RunSlam, AStopFromOutsideKeepsWhatWasMade) {
  CornerSource source(100000);
  std::stop_source stop;
  const RunOutcome outcome = run_slam({}, {}, source, stop.get_token(), [&](const Progress& progress) {
    if (progress.frames >= 5) stop.request_stop();
  });
  EXPECT_TRUE(outcome.interrupted);
  EXPECT_TRUE(outcome.failure.empty()) << outcome.failure;
  EXPECT_LT(outcome.frames.size(), 2000u);
  EXPECT_GT(outcome.final.gaussians.size(), 0u);
}

TEST(RunSlam, AListenerThatThrowsEndsTheRunWithEverythingMadeSoFar) {
  for (const int threads : {1, 2}) {
    CornerSource source(20);
    const RunOutcome outcome = run_slam({}, deterministic(threads), source, {}, [](const Progress& progress) {
      if (progress.frames >= 10) throw std::runtime_error("the window was closed");
    });
    EXPECT_EQ(outcome.failure, "progress report: the window was closed");
    EXPECT_GE(outcome.frames.size(), 10u);
    EXPECT_GT(outcome.final.gaussians.size(), 0u);
  }
}

TEST(RunSlam, AListenerMayThrowAnything) {
  CornerSource source(20);
  const RunOutcome outcome = run_slam({}, deterministic(2), source, {}, [](const Progress&) { throw 42; });
  EXPECT_TRUE(outcome.failure.starts_with("progress report: ")) << outcome.failure;
}

TEST(RunSlam, ThePreviewShowsThePathSoFar) {
  for (const int threads : {1, 2}) {
    RunSettings settings = deterministic(threads);
    settings.preview = true;
    CornerSource source(20);
    source.defect_at = 6;
    std::vector<Vec3> last;
    int reports = 0;
    bool is_done = false;
    const RunOutcome outcome = run_slam({}, settings, source, {}, [&](const Progress& progress) {
      ASSERT_GE(progress.positions.size(), last.size());
      EXPECT_TRUE(std::equal(last.begin(), last.end(), progress.positions.begin())) << "what was shown stays";
      last = progress.positions;
      is_done = progress.phase == Progress::Phase::done;
      EXPECT_TRUE(!is_done || progress.comparison) << "however short the run";
      ++reports;
    });
    std::vector<Vec3> path;
    for (const FrameOutcome& frame : outcome.frames) {
      if (frame.has_pose) path.push_back(frame.online_camera_from_world.inverse().translation);
    }
    EXPECT_EQ(path.size(), 19u);
    EXPECT_EQ(last, path) << "once each, in order";
    EXPECT_TRUE(is_done);
    if (threads == 1) {
      EXPECT_GE(reports, 20) << "after every frame";
    }
  }
}

TEST(RunSlam, RefinementRunsTheIterationsAskedFor) {
  RunSettings settings = deterministic(2);
  settings.refine_iterations = 25;
  const RunOutcome outcome = run(CornerSource(12), settings);
  EXPECT_EQ(outcome.iterations, 12 * 2 - 2 * 3 + 25) << "no iterations before the first keyframe has arrived";
}

TEST(RunSlam, AnEmptySourceGivesAnEmptyMap) {
  const RunOutcome outcome = run(CornerSource(0), deterministic(1));
  EXPECT_TRUE(outcome.frames.empty());
  EXPECT_TRUE(outcome.final.gaussians.empty());
  EXPECT_TRUE(outcome.failure.empty());
}

}  // namespace
}  // namespace photoslam
