// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Undistortion on a GPU against the CPU's, byte for byte. The GPU is the host in its role; a real one is tried where
// there is one.
#ifndef __SANITIZE_THREAD__  // it does not know fibers
#include "splatting/gpu_undistorter.h"

#include <gtest/gtest.h>

#include <thread>

#include "base/random.h"
#include "image/undistort.h"
#include "splatting/cuda/engine.h"
#include "splatting/cuda/host_device.h"
#include "splatting/gpu.h"
#include "splatting/testing/scenes.h"

namespace photoslam::splatting {
namespace {

using cuda::DevicePicture;
using cuda::HostDevice;
using cuda::HostFaults;

std::shared_ptr<Gpu> make_gpu(HostFaults* faults = nullptr) {
  return std::make_shared<Gpu>(
      std::make_unique<cuda::Engine<HostDevice>>(HostDevice(cuda::ThreadOrder::forwards, faults), uint64_t{1} << 26),
      "host");
}

/// Any lens, a part of whose result has no data.
Undistorter make_lens(Random& random) {
  const PinholeCamera lens = {.width = 2 + random.index(90),
                              .height = 2 + random.index(70),
                              .fx = random.uniform(20, 80),
                              .fy = random.uniform(20, 80),
                              .cx = random.uniform(0, 60),
                              .cy = random.uniform(0, 50)};
  const Distortion distortion = {.k1 = random.uniform(-0.3, 0.5),
                                 .k2 = random.uniform(-0.3, 0.3),
                                 .p1 = random.uniform(-0.01, 0.01),
                                 .p2 = random.uniform(-0.01, 0.01),
                                 .k3 = random.uniform(0, 0.2)};
  PinholeCamera result = lens;
  if (random.uniform() < 0.5) result.width += random.index(20), result.fx *= 1.3;
  const Quat turn(Eigen::AngleAxisd(random.uniform(-0.1, 0.1), Vec3::UnitY()));
  return {lens, distortion, result, turn};
}

template <class T>
Image<T> make_picture(Random& random, const Undistorter& lens, int channels = 1) {
  Image<T> picture(lens.lens().width, lens.lens().height, channels);
  for (T& value : picture.values()) value = static_cast<T>(random.index(65536));
  return picture;
}

void expect_bytes_of_the_cpu(const Gpu& gpu, int rounds) {
  Random random(81);
  size_t with_data = 0, without = 0;
  for (int round = 0; round < rounds; ++round) {
    const Undistorter lens = make_lens(random);
    const PinholeCamera& to = lens.camera();
    for (const uint8_t data : lens.mask().values()) ++(data != 0 ? with_data : without);
    const cuda::DeviceLens plain = {lens.lens().width, lens.lens().height, lens.taps().data(), to.width, to.height};
    const auto undistorter = gpu.make_undistorter({&plain, 1});
    ASSERT_EQ(undistorter->failure(), "");
    for (const int channels : {3, 1, 3}) {
      const ImageU8 color = make_picture<uint8_t>(random, lens, channels);
      const ImageU16 depth = make_picture<uint16_t>(random, lens);
      ImageU8 got_color(to.width, to.height, channels, 99);
      ImageU16 got_depth(to.width, to.height, 1, 99);
      using Kind = DevicePicture::Kind;
      const DevicePicture pictures[] = {
          {0, channels == 3 ? Kind::rgb : Kind::grey, color.values().data(), got_color.values().data()},
          {0, Kind::depth, depth.values().data(), got_depth.values().data()}};
      ASSERT_TRUE(undistorter->undistort(pictures));
      ASSERT_EQ(got_color, lens.color(color)) << round;
      ASSERT_EQ(got_depth, lens.depth(depth)) << round;
    }
  }
  EXPECT_GT(with_data, 1000u);
  EXPECT_GT(without, 1000u);
}

TEST(Gpu, UndistortsAsTheCpuDoes) { expect_bytes_of_the_cpu(*make_gpu(), 20); }

TEST(Gpu, OfThisMachineUndistortsAsTheCpuDoes) {
  const auto gpu = Gpu::open(1000);
  if (!gpu) GTEST_SKIP() << gpu.error().message;
  expect_bytes_of_the_cpu(**gpu, 200);
}

/// Training on one thread, frames on another: a stream each.
void expect_to_undistort_during_training(const std::shared_ptr<Gpu>& gpu, int steps) {
  testing::Scene scene;
  scene.width = 40;
  scene.height = 33;
  scene.count = 100;
  scene.build(82);
  const TargetImage target(scene.width, scene.height, std::vector<uint8_t>(3 * scene.plane(), 100));
  std::thread training([&] {
    SerialExecutor executor;
    Trainer trainer(gpu);
    TrainOptions options;
    options.render = scene.options;
    for (int i = 0; i < steps; ++i) trainer.step(scene.model, scene.view, target, options, executor);
  });
  expect_bytes_of_the_cpu(*gpu, 10);
  training.join();
  EXPECT_EQ(gpu->failure(), "");
}

TEST(Gpu, UndistortsWhileItTrains) { expect_to_undistort_during_training(make_gpu(), 3); }

TEST(Gpu, OfThisMachineUndistortsWhileItTrains) {
  const auto gpu = Gpu::open(1000);
  if (!gpu) GTEST_SKIP() << gpu.error().message;
  expect_to_undistort_during_training(*gpu, 300);
}

TEST(Gpu, ThatFailsToUndistortSaysSoAndMayStillTrain) {
  Random random(83);
  const Undistorter lens = make_lens(random);
  const cuda::DeviceLens plain = {lens.lens().width, lens.lens().height, lens.taps().data(), lens.camera().width,
                                  lens.camera().height};
  HostFaults faults;
  bool full = false;
  faults.no_memory = [&] { return full; };
  const auto gpu = make_gpu(&faults);
  const auto undistorter = gpu->make_undistorter({&plain, 1});
  EXPECT_EQ(undistorter->failure(), "");
  full = true;
  const auto late = gpu->make_undistorter({&plain, 1});
  EXPECT_NE(late->failure(), "");
  EXPECT_FALSE(late->undistort({}));
  const ImageU8 color = make_picture<uint8_t>(random, lens);
  ImageU8 target(lens.camera().width, lens.camera().height);
  const DevicePicture picture{0, DevicePicture::Kind::grey, color.values().data(), target.values().data()};
  EXPECT_FALSE(undistorter->undistort({&picture, 1}));
  EXPECT_NE(undistorter->failure(), "");
  full = false;
  EXPECT_FALSE(undistorter->undistort({&picture, 1}));  // once and for all
  EXPECT_EQ(gpu->failure(), "");
}

}  // namespace
}  // namespace photoslam::splatting

#endif  // __SANITIZE_THREAD__
