// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/absolute_pose.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "base/random.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera{640, 480, 500, 510, 330, 235};

SE3 random_pose(Random& random) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = random.uniform(-1.5, 1.5);
  return SE3::exp(twist);
}

TEST(P3P, FindsThePoseAndOnlyPosesThatExplainTheRays) {
  Random random(1);
  constexpr int kTrials = 5000;
  int found_truth = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const SE3 truth = random_pose(random);
    Vec3 points[3], rays[3];
    for (int k = 0; k < 3; ++k) {
      const Vec3 x = kCamera.unproject({random.uniform(0, 639), random.uniform(0, 479)}, random.uniform(0.5, 10));
      rays[k] = x.normalized();
      points[k] = truth.inverse() * x;
    }
    SE3 poses[4];
    const int count = solve_p3p(points, rays, poses);
    bool found = false;
    for (int i = 0; i < count; ++i) {
      for (int k = 0; k < 3; ++k) EXPECT_LT(((poses[i] * points[k]).normalized() - rays[k]).norm(), 1e-6);
      found |= (poses[i] * truth.inverse()).log().norm() < 1e-5;
    }
    found_truth += found;
  }
  // A few triangles are so close to degenerate that doubles do not suffice.
  EXPECT_GE(found_truth, kTrials * 0.998) << found_truth;
}

TEST(P3P, DegenerateTrianglesDoNotFail) {
  SE3 poses[4];
  const Vec3 rays[3] = {Vec3(0, 0, 1), Vec3(0.1, 0, 1).normalized(), Vec3(0.2, 0, 1).normalized()};
  const Vec3 collinear[3] = {Vec3(0, 0, 1), Vec3(0.1, 0, 1), Vec3(0.2, 0, 1)};
  const Vec3 same[3] = {Vec3(0, 0, 1), Vec3(0, 0, 1), Vec3(0, 0, 1)};
  for (const auto* points : {collinear, same}) {
    const int count = solve_p3p(points, rays, poses);
    for (int i = 0; i < count; ++i) EXPECT_TRUE(poses[i].matrix().allFinite());
  }
}

struct Correspondences {
  SE3 truth;
  std::vector<Vec3> points;
  std::vector<Vec2> pixels;
  std::vector<uint8_t> good;
};

Correspondences make(int count, double outlier_share, double noise, uint64_t seed) {
  Random random(seed);
  Correspondences c;
  c.truth = random_pose(random);
  for (int i = 0; i < count; ++i) {
    const Vec2 pixel(random.uniform(0, 639), random.uniform(0, 479));
    c.points.push_back(c.truth.inverse() * kCamera.unproject(pixel, random.uniform(1, 6)));
    c.good.push_back(random.uniform() >= outlier_share);
    c.pixels.push_back(c.good.back() ? Vec2(pixel + noise * Vec2(random.normal(), random.normal()))
                                     : Vec2(random.uniform(0, 639), random.uniform(0, 479)));
  }
  return c;
}

TEST(PoseRansac, FindsThePoseAmongSixtyPercentOutliers) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Correspondences c = make(120, 0.6, 1, seed);
    const auto result = estimate_pose_ransac({}, kCamera, c.points, c.pixels);
    ASSERT_TRUE(result.success) << seed;
    const Vec6 error = (result.camera_from_world * c.truth.inverse()).log();
    EXPECT_LT(error.head<3>().norm(), 0.06) << seed;
    EXPECT_LT(error.tail<3>().norm(), 0.015) << seed;
    int good = 0, kept = 0, wrong = 0;
    for (size_t i = 0; i < c.good.size(); ++i) {
      good += c.good[i];
      kept += c.good[i] && result.inlier[i];
      wrong += !c.good[i] && result.inlier[i];
    }
    EXPECT_GE(kept, 0.95 * good);
    EXPECT_LE(wrong, 3);
    EXPECT_EQ(kept + wrong, result.num_inliers);
  }
}

TEST(PoseRansac, StopsEarlyOnCleanData) {
  const Correspondences c = make(100, 0, 0.5, 3);
  const auto result = estimate_pose_ransac({}, kCamera, c.points, c.pixels);
  EXPECT_TRUE(result.success);
  EXPECT_LT(result.iterations, 30);
}

TEST(PoseRansac, FailsOnNoiseAndOnTooFew) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Correspondences noise = make(100, 1.0, 0, seed);
    EXPECT_FALSE(estimate_pose_ransac({}, kCamera, noise.points, noise.pixels).success);
  }
  const Correspondences few = make(5, 0, 0, 1);
  EXPECT_FALSE(estimate_pose_ransac({}, kCamera, few.points, few.pixels).success);
  EXPECT_FALSE(estimate_pose_ransac({}, kCamera, {}, {}).success);
  EXPECT_THROW(estimate_pose_ransac({}, kCamera, few.points, {}), CheckError);
}

TEST(PoseRansac, SkipsValuesThatAreNotFinite) {
  Correspondences c = make(60, 0.2, 0.5, 7);
  c.points[3].x() = std::nan("");
  c.pixels[4].y() = std::numeric_limits<double>::infinity();
  const auto result = estimate_pose_ransac({}, kCamera, c.points, c.pixels);
  EXPECT_TRUE(result.success);
  EXPECT_FALSE(result.inlier[3]);
  EXPECT_FALSE(result.inlier[4]);
  EXPECT_LT((result.camera_from_world * c.truth.inverse()).log().norm(), 0.05);
}

TEST(PoseRansac, SigmasWidenTheThreshold) {
  Correspondences c = make(60, 0, 0, 8);
  for (size_t i = 0; i < 10; ++i) c.pixels[i].x() += 6;
  std::vector<double> sigmas(60, 1.0);
  EXPECT_EQ(estimate_pose_ransac({}, kCamera, c.points, c.pixels, sigmas).num_inliers, 50);
  for (size_t i = 0; i < 10; ++i) sigmas[i] = 2;
  EXPECT_EQ(estimate_pose_ransac({}, kCamera, c.points, c.pixels, sigmas).num_inliers, 60);
}

}  // namespace
}  // namespace photoslam
