// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Frames rectified on a GPU, the host in its role, against the CPU.
#ifndef __SANITIZE_THREAD__  // it does not know fibers
#include "pipeline/frame_rectifier.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "splatting/testing/host_gpu.h"

namespace photoslam {
namespace {

using splatting::cuda::HostFaults;
using splatting::testing::make_host_gpu;

SourceInfo distorted(SensorKind sensor) {
  SourceInfo info;
  info.sensor = sensor;
  info.camera = {.width = 53, .height = 41, .fx = 45, .fy = 46, .cx = 25.5, .cy = 21};
  info.distortion = {.k1 = 0.3, .k2 = 0.1, .p1 = 1e-3};
  if (sensor == SensorKind::stereo) {
    info.right = RightCamera{
        info.camera, {.k1 = -0.2, .k2 = 0.04}, SE3(so3_exp(Vec3(0.01, -0.02, 0.015)), Vec3(-0.1, 0.002, 0.001))};
    info.right->camera.width = 49;
  }
  return info;
}

template <class T>
Image<T> noise(Random& random, const PinholeCamera& camera, int channels) {
  Image<T> picture(camera.width, camera.height, channels);
  for (T& value : picture.values()) value = static_cast<T>(random.index(65536));
  return picture;
}

FramePictures frame(Random& random, const SourceInfo& info, int channels) {
  FramePictures pictures{noise<uint8_t>(random, info.camera, channels), {}, {}};
  if (info.sensor == SensorKind::rgbd) pictures.depth = noise<uint16_t>(random, info.camera, 1);
  if (info.right) pictures.right = noise<uint8_t>(random, info.right->camera, channels);
  return pictures;
}

void expect_rectified(const FramePictures& got, const FramePictures& raw, const FrameRectifier& by) {
  EXPECT_EQ(got.color, by.color(raw.color));
  EXPECT_EQ(got.depth, by.depth(raw.depth));
  EXPECT_EQ(got.right, by.right(raw.right));
}

TEST(FrameRectifier, GivesTheSameBytesOnAGpu) {
  Random random(91);
  for (const SensorKind sensor : {SensorKind::mono, SensorKind::rgbd, SensorKind::stereo}) {
    const SourceInfo info = distorted(sensor);
    const auto gpu = make_host_gpu();
    const double before = gpu->peak_mb();
    FrameRectifier on_gpu(info, gpu.get()), on_cpu(info);
    for (const int channels : {3, 1, 3}) {
      const FramePictures raw = frame(random, info, channels);
      expect_rectified(on_gpu.rectify(raw), raw, on_cpu);
      expect_rectified(on_cpu.rectify(raw), raw, on_cpu);
    }
    FramePictures without_depth = frame(random, info, 3);
    without_depth.depth = {};
    expect_rectified(on_gpu.rectify(without_depth), without_depth, on_cpu);
    EXPECT_EQ(on_gpu.gpu_failure(), "");
    EXPECT_GT(gpu->peak_mb(), before);
    EXPECT_THROW(on_gpu.rectify({ImageU8(3, 3), {}, {}}), CheckError);
  }
}

TEST(FrameRectifier, TakesNothingOfAGpuWherePicturesFitAlready) {
  SourceInfo info = distorted(SensorKind::rgbd);
  info.distortion = {};
  const auto gpu = make_host_gpu();
  const double before = gpu->peak_mb();
  FrameRectifier rectifier(info, gpu.get());
  Random random(92);
  const FramePictures raw = frame(random, info, 3);
  EXPECT_EQ(rectifier.rectify(raw).color, raw.color);
  EXPECT_EQ(gpu->peak_mb(), before);
  EXPECT_EQ(rectifier.gpu_failure(), "");
}

/// Three frames, of which the faults may spoil any part; how often they were asked.
int rectify_with(const SourceInfo& info, std::function<bool()> HostFaults::* kind, int spoiled, bool& failed) {
  HostFaults faults;
  int calls = 0;
  faults.*kind = [&] { return calls++ == spoiled; };
  const auto gpu = make_host_gpu(&faults);
  FrameRectifier on_gpu(info, gpu.get()), on_cpu(info);
  Random random(93);
  for (int i = 0; i < 3; ++i) {
    const FramePictures raw = frame(random, info, 3);
    expect_rectified(on_gpu.rectify(raw), raw, on_cpu);
  }
  failed = !on_gpu.gpu_failure().empty();
  return calls;
}

TEST(FrameRectifier, GoesOnWithTheSameBytesWheneverTheGpuFails) {
  for (const SensorKind sensor : {SensorKind::rgbd, SensorKind::stereo}) {
    const SourceInfo info = distorted(sensor);
    for (const auto kind : {&HostFaults::no_memory, &HostFaults::lost}) {
      bool failed = false;
      const int calls = rectify_with(info, kind, -1, failed);
      EXPECT_FALSE(failed);
      const int first = kind == &HostFaults::no_memory ? 1 : 0;  // the engine's own memory comes before
      EXPECT_GT(calls, first + 1);
      for (int i = first; i < calls; ++i) {
        rectify_with(info, kind, i, failed);
        EXPECT_TRUE(failed) << "call " << i;
      }
    }
  }
}

}  // namespace
}  // namespace photoslam

#endif  // __SANITIZE_THREAD__
