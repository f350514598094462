// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
// Lenses, shutters and stereo rigs in the synthetic world, against geometry.
#include <gtest/gtest.h>

#include <algorithm>

#include "sources/synthetic/room.h"
#include "sources/synthetic/synthetic_source.h"

namespace photoslam {
namespace {

/// One draft room for all tests of this file: it takes seconds to build.
const std::shared_ptr<const SyntheticWorld>& room() {
  static const std::shared_ptr<const SyntheticWorld> kRoom = [] {
    ThreadPool pool(2);
    return std::make_shared<const SyntheticRoom>(1, pool, SceneQuality::draft);
  }();
  return kRoom;
}

SyntheticOptions small(SensorKind sensor) {
  SyntheticOptions options;
  options.sensor = sensor;
  options.num_frames = 3;
  options.camera = {.width = 120, .height = 90, .fx = 98, .fy = 97, .cx = 61, .cy = 43};
  options.image_noise = 0;
  return options;
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// Median difference in grey levels between the left pixels and what the right camera sees of the same points.
double median_stereo_error(const SyntheticOptions& options) {
  SerialExecutor serial;
  const SyntheticCamera camera(room(), options);
  const SceneView ideal = camera.view(1, serial);
  const Frame frame = camera.frame(1, serial);
  const RightCamera right = camera.info().right.value();
  const CameraRays rays(options.camera, options.distortion);
  std::vector<double> errors;
  for (int y = 0; y < options.camera.height; ++y) {
    for (int x = 0; x < options.camera.width; ++x) {
      const Vec3 ray = rays.ray(x, y, CameraRays::kCentre);
      if (ray.isZero() || ideal.depth(x, y) <= 0) continue;
      const Vec3 in_right = right.right_from_left * (ray * ideal.depth(x, y));
      const Vec2 distorted = distort(right.distortion, in_right.head<2>() / in_right.z());
      const Vec2 pixel = right.camera.project(distorted.homogeneous());
      if (!right.camera.contains(pixel, 1)) continue;
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      errors.push_back(std::abs(frame.right(u, v, 1) - frame.color(x, y, 1)));
    }
  }
  EXPECT_GT(errors.size(), 4000u);
  return median(errors);
}

TEST(SyntheticRig, RightImageShowsTheSamePoints) {
  SyntheticOptions options = small(SensorKind::stereo);
  const double parallel = median_stereo_error(options);
  EXPECT_LT(parallel, 6);
  options.distortion = {-0.28, 0.07, 0.0002, -0.0003};
  EXPECT_LT(median_stereo_error(options), 6);
  options.distortion = {.k1 = 0.004, .k2 = 0.002, .k3 = -0.003, .k4 = 0.0005, .model = LensModel::kannala_brandt};
  options.camera.fx = options.camera.fy = 47;
  EXPECT_LT(median_stereo_error(options), 6);
  // The figure means something: without the baseline it is far larger.
  SerialExecutor serial;
  options = small(SensorKind::stereo);
  const Frame frame = SyntheticCamera(room(), options).frame(1, serial);
  std::vector<double> unshifted;
  for (size_t i = 0; i < frame.color.values().size(); ++i) {
    unshifted.push_back(std::abs(frame.color.values()[i] - frame.right.values()[i]));
  }
  EXPECT_GT(median(unshifted), 1.5 * parallel);
}

TEST(SyntheticRig, DistortedDepthIsThatOfTheStraightRay) {
  SerialExecutor serial;
  SyntheticOptions options = small(SensorKind::rgbd);
  const PinholeCamera pinhole = options.camera;
  options.distortion = {-0.28, 0.07, 0.0002, -0.0003};
  const SyntheticCamera camera(room(), options);
  const SceneView bent = camera.view(0, serial);
  for (const auto& [x, y] : {std::pair{60, 45}, {20, 30}, {101, 70}}) {
    const Vec2 p((x - pinhole.cx) / pinhole.fx, (y - pinhole.cy) / pinhole.fy);
    const Vec2 straight = pinhole.project(undistort(options.distortion, p)->homogeneous());
    PinholeCamera one = pinhole;  // a camera with that ray through its pixel (0, 0)
    one.width = one.height = 1;
    one.cx -= straight.x();
    one.cy -= straight.y();
    EXPECT_NEAR(room()->render(camera.world_from_camera(0), one, serial).depth(0, 0), bent.depth(x, y), 1e-4);
  }
}

TEST(SyntheticRig, RollingShutterShowsEveryRowAtItsTime) {
  SerialExecutor serial;
  SyntheticOptions options = small(SensorKind::rgbd);
  options.readout_s = 0.03;
  const SyntheticCamera camera(room(), options);
  const SceneView rolling = camera.view(2, serial);
  const auto path = room()->path(static_cast<uint64_t>(options.seed), options.seconds_per_lap);
  const double middle = static_cast<double>(camera.timestamp_ns(2)) * 1e-9;
  for (const int row : {0, 30, 89}) {
    const double time = middle + 0.03 * ((row + 0.5) / 90 - 0.5);
    const SceneView still = room()->render(path->world_from_camera(time), options.camera, serial);
    for (int x = 0; x < options.camera.width; ++x) EXPECT_FLOAT_EQ(rolling.depth(x, row), still.depth(x, row));
  }
}

TEST(SyntheticRig, MotionBlurIsTheMeanOverTheExposure) {
  SerialExecutor serial;
  SyntheticOptions options = small(SensorKind::mono);
  options.shutter_s = 0.05;
  options.seconds_per_lap = 4;
  const SyntheticCamera camera(room(), options);
  const SceneView blurred = camera.view(2, serial);
  const auto path = room()->path(static_cast<uint64_t>(options.seed), options.seconds_per_lap);
  constexpr int kMoments = 24;
  std::vector<double> mean(blurred.radiance.values().size());
  const double middle = static_cast<double>(camera.timestamp_ns(2)) * 1e-9;
  for (int i = 0; i < kMoments; ++i) {
    const double time = middle + 0.05 * ((i + 0.5) / kMoments - 0.5);
    const SceneView still = room()->render(path->world_from_camera(time), options.camera, serial);
    for (size_t k = 0; k < mean.size(); ++k) mean[k] += still.radiance.values()[k] / static_cast<double>(kMoments);
  }
  const SceneView sharp = room()->render(camera.world_from_camera(2), options.camera, serial);
  double error = 0, unblurred = 0;
  for (size_t k = 0; k < mean.size(); ++k) {
    error += std::abs(blurred.radiance.values()[k] - mean[k]);
    unblurred += std::abs(sharp.radiance.values()[k] - mean[k]);
  }
  EXPECT_LT(error, 0.4 * unblurred);
}

TEST(SyntheticRig, WithoutReflectionsASurfaceIsAtMostAsBright) {
  SerialExecutor serial;
  SyntheticOptions options = small(SensorKind::mono);
  const SyntheticCamera camera(room(), options);
  options.reflections = 0;
  const SyntheticCamera matt(room(), options);
  options.reflections = 0.5;
  const SyntheticCamera half(room(), options);
  const SceneView with = camera.view(0, serial), without = matt.view(0, serial), between = half.view(0, serial);
  int brighter = 0;
  for (size_t k = 0; k < with.radiance.values().size(); ++k) {
    const float most = with.radiance.values()[k], least = without.radiance.values()[k];
    EXPECT_LE(least, most);
    if (most < 2) {
      EXPECT_NEAR(between.radiance.values()[k], 0.5f * (most + least), 1e-4f) << k;
    }
    brighter += with.radiance.values()[k] > without.radiance.values()[k] + 1e-3f;
  }
  EXPECT_GT(brighter, 100) << "the floor, and the glass of the pictures";
  EXPECT_TRUE(std::ranges::equal(without.depth.values(), with.depth.values()));
}

TEST(SyntheticRig, ExposureJumpsAndStays) {
  SerialExecutor serial;
  SyntheticOptions options = small(SensorKind::mono);
  options.exposure_jumps = 1;
  options.frames_per_second = 2;
  options.num_frames = 12;
  const SyntheticCamera camera(room(), options);
  options.exposure_jumps = 0;
  const SyntheticCamera steady(room(), options);
  std::vector<int> brighter;
  for (int i = 0; i < 12; ++i) {
    const Frame a = camera.frame(i, serial), b = steady.frame(i, serial);
    int64_t sum = 0;
    for (size_t k = 0; k < a.color.values().size(); ++k) sum += a.color.values()[k] - b.color.values()[k];
    const auto mean = sum / static_cast<int64_t>(a.color.values().size());
    brighter.push_back(mean > 5 ? 1 : mean < -5 ? -1 : 0);
  }
  // Three frames per step; the first step is the usual exposure, and every step differs from the one before.
  for (int i = 0; i < 12; ++i) EXPECT_EQ(brighter[static_cast<size_t>(i)], brighter[static_cast<size_t>(i / 3 * 3)]);
  EXPECT_EQ(brighter[0], 0);
  for (size_t i = 3; i < 12; i += 3) EXPECT_NE(brighter[i], brighter[i - 3]);
}

}  // namespace
}  // namespace photoslam
