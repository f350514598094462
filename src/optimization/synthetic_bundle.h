// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "base/random.h"
#include "optimization/bundle_adjustment.h"

namespace photoslam {

/// A camera that moves along a curved wall of points, with exact truth: for tests and benchmarks.
struct SyntheticBundle {
  static constexpr PinholeCamera kCamera{640, 480, 520, 515, 321.5, 238.25};
  static constexpr double kBf = 40;

  BundleProblem truth;    ///< Exact poses and points.
  BundleProblem problem;  ///< Perturbed; the observations of both are the noisy ones.

  struct Options {
    int num_poses = 10;
    int num_points = 500;
    double step = 0.15;  ///< Distance between poses [m].
    double noise_px = 1;
    double depth_share = 0.7;
    double outlier_share = 0;
    double pose_error = 0.02;
    double point_error = 0.05;
    int num_fixed = 1;
    uint64_t seed = 1;
  };

  explicit SyntheticBundle(const Options& options) {
    Random random(options.seed);
    for (int i = 0; i < options.num_poses; ++i) {
      const double s = options.step * i;
      const SE3 world_from_camera(so3_exp(Vec3(0.1 * std::sin(s), 0.15 * std::sin(0.7 * s), 0.05 * std::cos(s))),
                                  Vec3(s, 0.2 * std::sin(s), 0.3 * std::cos(0.5 * s)));
      truth.camera_from_world.push_back(world_from_camera.inverse());
      truth.pose_is_fixed.push_back(i < options.num_fixed);
    }
    const double length = options.step * (options.num_poses - 1);
    for (int i = 0; i < options.num_points; ++i) {
      truth.points_in_world.push_back(
          {random.uniform(-1, length + 1), random.uniform(-1.5, 1.5), random.uniform(2, 4)});
    }
    for (int p = 0; p < options.num_points; ++p) {
      for (int c = 0; c < options.num_poses; ++c) observe(options, c, p, random);
    }
    problem = truth;
    const auto normal3 = [&random] { return Vec3(random.normal(), random.normal(), random.normal()); };
    for (int i = options.num_fixed; i < options.num_poses; ++i) {
      Vec6 twist;
      twist << normal3(), normal3() * 0.5;
      SE3& pose = problem.camera_from_world[static_cast<size_t>(i)];
      pose = SE3::exp(options.pose_error * twist) * pose;
    }
    for (Vec3& point : problem.points_in_world) point += options.point_error * normal3();
  }

 private:
  void observe(const Options& options, int camera, int point, Random& random) {
    const Vec3 x =
        truth.camera_from_world[static_cast<size_t>(camera)] * truth.points_in_world[static_cast<size_t>(point)];
    const Vec2 pixel = kCamera.project(x);
    if (!kCamera.contains(pixel)) return;
    const double sigma = std::pow(1.2, random.index(4));
    PixelObservation o;
    o.pixel = pixel + options.noise_px * sigma * Vec2(random.normal(), random.normal());
    o.inverse_variance = 1 / (sigma * sigma);
    if (random.uniform() < options.depth_share) {
      o.u_right = pixel.x() - kBf / x.z() + options.noise_px * sigma * random.normal();
    }
    if (random.uniform() < options.outlier_share) o.pixel += Vec2(random.uniform(-60, 60), random.uniform(-60, 60));
    truth.observations.push_back({camera, point, o});
  }
};

}  // namespace photoslam
