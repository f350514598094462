// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/room.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "sources/synthetic/detail.h"
#include "sources/synthetic/room_trajectory.h"
#include "sources/synthetic/sensor_model.h"
#include "sources/synthetic/synthetic_options.h"

namespace photoslam {
namespace {

/// A level camera at a place, looking at another one.
SE3 look(const Vec3& from, const Vec3& at) {
  Mat3 axes;
  axes.col(2) = (at - from).normalized();
  axes.col(0) = axes.col(2).cross(Vec3(0.02, 0.01, 1)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {Quat(axes), from};
}

/// Largest relative difference of a view's depth from that of the plane n·x = d, which fills the view.
double largest_depth_error(const SyntheticRoom& room, const SE3& world_from_camera, const Vec3& n, double d) {
  // Narrow, and with a principal point far off the centre.
  const PinholeCamera camera{.width = 70, .height = 49, .fx = 310, .fy = 290, .cx = 22.3, .cy = 31.8};
  SerialExecutor serial;
  const SceneView view = room.render(world_from_camera, camera, serial);
  double worst = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = world_from_camera.rotation * camera.unproject(Vec2(x, y), 1.0);
      const double depth = (d - n.dot(world_from_camera.translation)) / n.dot(ray);
      worst = std::max(worst, std::abs(view.depth(x, y) / depth - 1));
      EXPECT_NEAR(view.incidence(x, y), std::abs(n.dot(ray.normalized())), 1e-5);
    }
  }
  return worst;
}

TEST(SyntheticRoom, DepthOfBareSurfacesIsTheClosedForm) {
  ThreadPool pool(2);
  const SyntheticRoom room(1, pool, SceneQuality::draft);
  // Floor in the east, brick wall above the pin board, south wall above the door.
  EXPECT_LT(largest_depth_error(room, look({3.9, 2.5, 1.5}, {4.3, 2.1, 0}), Vec3::UnitZ(), 0), 2e-7);
  EXPECT_LT(largest_depth_error(room, look({3.0, 2.4, 1.9}, {2.7, 4.2, 2.2}), Vec3::UnitY(), 4.2), 2e-7);
  EXPECT_LT(largest_depth_error(room, look({4.2, 1.9, 2.1}, {4.5, 0, 2.33}), Vec3::UnitY(), 0), 2e-7);
}

TEST(SyntheticRoom, ViewsAgreeAboutTheWorld) {
  ThreadPool pool(2);
  const SyntheticRoom room(2, pool, SceneQuality::draft);
  const PinholeCamera camera{.width = 160, .height = 120, .fx = 131.4, .fy = 131.1, .cx = 81.7, .cy = 57.4};
  const RoomTrajectory trajectory(2, 10);
  const SE3 world_from_a = trajectory.world_from_camera(1.0), world_from_b = trajectory.world_from_camera(1.6);
  const SceneView a = room.render(world_from_a, camera, pool), b = room.render(world_from_b, camera, pool);
  const SE3 b_from_a = world_from_b.inverse() * world_from_a;
  std::vector<double> depth_errors, light_errors;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 in_b = b_from_a * camera.unproject(Vec2(x, y), a.depth(x, y));
      const Vec2 pixel = camera.project(in_b);
      if (in_b.z() < 0.1 || !camera.contains(pixel, 1)) continue;
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      depth_errors.push_back(std::abs(b.depth(u, v) / in_b.z() - 1));
      light_errors.push_back(std::abs(b.radiance(u, v, 1) - a.radiance(x, y, 1)));
    }
  }
  ASSERT_GT(depth_errors.size(), 5000u);
  const auto median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  // The nearest pixel is up to half a pixel away.
  EXPECT_LT(median(depth_errors), 0.003);
  EXPECT_LT(median(light_errors), 0.03);
}

TEST(SyntheticRoom, LooksTheSameAtAnyThreadCount) {
  SerialExecutor serial;
  ThreadPool pool(2);
  const PinholeCamera camera{.width = 83, .height = 61, .fx = 68, .fy = 68, .cx = 41, .cy = 30};
  const SE3 pose = RoomTrajectory(1, 10).world_from_camera(2);
  const SceneView one = SyntheticRoom(1, serial, SceneQuality::draft).render(pose, camera, serial);
  const SceneView two = SyntheticRoom(1, pool, SceneQuality::draft).render(pose, camera, pool);
  EXPECT_EQ(one.radiance, two.radiance);
  EXPECT_EQ(one.depth, two.depth);
  EXPECT_EQ(one.incidence, two.incidence);
}

TEST(SyntheticRoom, IsAsDetailedAsARealOne) {
  ThreadPool pool(2);
  const SyntheticRoom room(1, pool);
  const SyntheticOptions options;
  const RoomTrajectory trajectory(1, options.seconds_per_lap);
  DetailFigures sum;
  constexpr int kViews = 8;
  for (int i = 0; i < kViews; ++i) {
    // No noise: the detail is in the scene.
    const SceneView view = room.render(trajectory.world_from_camera(10.0 * i / kViews), options.camera, pool);
    const DetailFigures figures = measure_detail(expose(view, 0, 0, 0));
    sum.shrunk_psnr_db += figures.shrunk_psnr_db / kViews;
    sum.horizontal_difference += figures.horizontal_difference / kViews;
    EXPECT_GT(*std::ranges::min_element(view.depth.values()), 0.5f) << "the camera runs into something";
  }
  EXPECT_LE(sum.shrunk_psnr_db, 25.0);
  EXPECT_GE(sum.horizontal_difference, 3.0);
}

}  // namespace
}  // namespace photoslam
