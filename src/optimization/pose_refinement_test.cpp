// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "optimization/pose_refinement.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "base/random.h"
#include "optimization/reprojection.h"

#ifdef PHOTOSLAM_HAS_CERES
#include "optimization/ceres_oracle.h"
#endif

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera{640, 480, 520, 515, 321.5, 238.25};
constexpr double kBf = 40;

struct Scene {
  SE3 truth;
  std::vector<Vec3> points;
  std::vector<PixelObservation> observations;
  std::vector<uint8_t> is_outlier;
};

SE3 random_motion(Random& random, double translation, double rotation) {
  Vec6 twist;
  for (int i = 0; i < 3; ++i) twist[i] = random.uniform(-translation, translation);
  for (int i = 3; i < 6; ++i) twist[i] = random.uniform(-rotation, rotation);
  return SE3::exp(twist);
}

Scene make_scene(int count, double noise, double outlier_share, double depth_share, uint64_t seed) {
  Random random(seed);
  Scene scene;
  scene.truth = random_motion(random, 1, 1);
  const SE3 world_from_camera = scene.truth.inverse();
  for (int i = 0; i < count; ++i) {
    const Vec2 pixel(random.uniform(0, 639), random.uniform(0, 479));
    const double z = random.uniform(1, 6), sigma = std::pow(1.2, random.index(8));
    scene.points.push_back(world_from_camera * kCamera.unproject(pixel, z));
    PixelObservation o;
    o.pixel = pixel + noise * sigma * Vec2(random.normal(), random.normal());
    if (random.uniform() < depth_share) o.u_right = pixel.x() - kBf / z + noise * sigma * random.normal();
    o.inverse_variance = 1 / (sigma * sigma);
    scene.is_outlier.push_back(random.uniform() < outlier_share);
    if (scene.is_outlier.back()) o.pixel = Vec2(random.uniform(0, 639), random.uniform(0, 479));
    scene.observations.push_back(o);
  }
  return scene;
}

/// d (u, v, u_right) / d twist by central differences; the third row only with depth.
Eigen::Matrix<double, 3, 6> numeric_jacobian(const SE3& pose, const Vec3& point, const PixelObservation& observation) {
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 3, 6> jacobian;
  for (int k = 0; k < 6; ++k) {
    const Vec6 step = kStep * Vec6::Unit(k);
    jacobian.col(k) = (Reprojection(kCamera, kBf, SE3::exp(step) * pose * point, observation).residual -
                       Reprojection(kCamera, kBf, SE3::exp(-step) * pose * point, observation).residual) /
                      (2 * kStep);
  }
  return jacobian;
}

TEST(Reprojection, DerivativesAgreeWithFiniteDifferences) {
  const Scene scene = make_scene(40, 3, 0, 0.5, 1);
  for (size_t i = 0; i < scene.points.size(); ++i) {
    const PixelObservation& observation = scene.observations[i];
    const Vec3 x = scene.truth * scene.points[i];
    const Reprojection reprojection(kCamera, kBf, x, observation);
    const double weight = 0.7;
    const PointDerivatives derivatives(kCamera, kBf, observation, reprojection, weight);
    const auto jacobian = numeric_jacobian(scene.truth, scene.points[i], observation);
    const Vec6 gradient = weight * jacobian.transpose() * reprojection.residual;
    const Eigen::Matrix<double, 6, 6> hessian = weight * jacobian.transpose() * jacobian;
    EXPECT_LT((gradient_by_twist(x, derivatives.gradient) - gradient).norm(), 1e-6 * gradient.norm());
    Eigen::Matrix<double, 6, 6> ours = Eigen::Matrix<double, 6, 6>::Zero();
    add_hessian_by_twist(x, derivatives.hessian, ours);
    const Eigen::Matrix<double, 6, 6> symmetric = ours.selfadjointView<Eigen::Lower>();
    EXPECT_LT((symmetric - hessian).norm(), 1e-6 * hessian.norm());
  }
}

TEST(HuberLoss, WeightIsTheDerivativeAndTheLossIsSmooth) {
  for (double s : {0.1, 1.0, 3.9, 4.0, 4.1, 50.0}) {
    const double h = 1e-5;
    const double slope = (HuberLoss(s + h, 2).value - HuberLoss(s - h, 2).value) / (2 * h);
    EXPECT_NEAR(HuberLoss(s, 2).weight, slope, 1e-5) << s;
  }
}

TEST(PoseRefinement, FindsTheExactPoseWithoutNoise) {
  for (double depth_share : {0.0, 0.5, 1.0}) {
    const Scene scene = make_scene(50, 0, 0, depth_share, 2);
    Random random(3);
    const auto result =
        refine_pose({}, kCamera, kBf, scene.points, scene.observations, random_motion(random, 0.1, 0.1) * scene.truth);
    ASSERT_TRUE(result.converged);
    EXPECT_EQ(result.num_inliers, 50);
    EXPECT_LT((result.camera_from_world * scene.truth.inverse()).log().norm(), 1e-8);
  }
}

TEST(PoseRefinement, ToleratesThirtyPercentOutliers) {
  for (uint64_t seed = 10; seed < 30; ++seed) {
    const Scene scene = make_scene(300, 1, 0.3, 0.7, seed);
    Random random(seed);
    const auto result = refine_pose({}, kCamera, kBf, scene.points, scene.observations,
                                    random_motion(random, 0.05, 0.03) * scene.truth);
    ASSERT_TRUE(result.converged);
    const Vec6 error = (result.camera_from_world * scene.truth.inverse()).log();
    EXPECT_LT(error.head<3>().norm(), 0.02) << seed;
    EXPECT_LT(error.tail<3>().norm(), 0.004) << seed;
    int good_kept = 0, good = 0, bad_kept = 0;
    for (size_t i = 0; i < 300; ++i) {
      good += !scene.is_outlier[i];
      good_kept += !scene.is_outlier[i] && result.inlier[i];
      bad_kept += scene.is_outlier[i] && result.inlier[i];
    }
    EXPECT_GT(good_kept, 0.9 * good);
    EXPECT_LE(bad_kept, 3);
  }
}

TEST(PoseRefinement, ErrorsMatchTheirCovariance) {
  // The squared Mahalanobis distance of the estimate from the truth is χ² with 6 degrees of freedom: mean 6.
  double sum = 0;
  constexpr int kTrials = 200;
  PoseRefinementOptions all_inliers;
  all_inliers.chi2_mono = all_inliers.chi2_depth = 1e6;
  for (uint64_t seed = 0; seed < kTrials; ++seed) {
    const Scene scene = make_scene(100, 1, 0, 0.5, 100 + seed);
    const auto result = refine_pose(all_inliers, kCamera, kBf, scene.points, scene.observations, scene.truth);
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
    for (size_t i = 0; i < scene.points.size(); ++i) {
      const auto jacobian = numeric_jacobian(scene.truth, scene.points[i], scene.observations[i]);
      information += scene.observations[i].inverse_variance * jacobian.transpose() * jacobian;
    }
    const Vec6 error = (result.camera_from_world * scene.truth.inverse()).log();
    sum += error.dot(information * error);
  }
  EXPECT_NEAR(sum / kTrials, 6, 1);
}

TEST(PoseRefinement, BadDataCountAsOutliers) {
  Scene scene = make_scene(60, 0.1, 0, 0.5, 4);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  scene.points[0] = Vec3::Constant(kNan);
  scene.points[1] = scene.truth.inverse() * Vec3(0, 0, -2);
  scene.observations[2].pixel.x() = kInf;
  scene.observations[3].u_right = kInf;
  scene.observations[4].inverse_variance = kNan;
  scene.points[5] = Vec3::Constant(kInf);
  const auto result = refine_pose({}, kCamera, kBf, scene.points, scene.observations, scene.truth);
  ASSERT_TRUE(result.converged);
  for (size_t i = 0; i < 6; ++i) EXPECT_FALSE(result.inlier[i]) << i;
  EXPECT_EQ(result.num_inliers, 54);
  EXPECT_LT((result.camera_from_world * scene.truth.inverse()).log().norm(), 1e-3);
}

TEST(PoseRefinement, TooFewObservationsReturnTheInitialPose) {
  const Scene scene = make_scene(3, 0, 0, 0, 5);
  Random random(6);
  const SE3 initial = random_motion(random, 0.1, 0.1) * scene.truth;
  const auto result = refine_pose({}, kCamera, kBf, scene.points, scene.observations, initial);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.camera_from_world.matrix(), initial.matrix());
  EXPECT_FALSE(refine_pose({}, kCamera, kBf, {}, {}, initial).converged);
  EXPECT_THROW(refine_pose({}, kCamera, kBf, scene.points, {}, initial), CheckError);
}

#ifdef PHOTOSLAM_HAS_CERES
TEST(PoseRefinement, AgreesWithCeres) {
  for (uint64_t seed = 40; seed < 50; ++seed) {
    const Scene scene = make_scene(200, 1, 0.3, 0.5, seed);
    Random random(seed);
    // Many rounds, so that the last one works on the inliers that it returns.
    PoseRefinementOptions options;
    options.rounds = 10;
    const auto ours = refine_pose(options, kCamera, kBf, scene.points, scene.observations,
                                  random_motion(random, 0.03, 0.02) * scene.truth);
    BundleProblem problem;
    problem.camera_from_world = {random_motion(random, 0.01, 0.01) * scene.truth};
    problem.pose_is_fixed = {0};
    for (size_t i = 0; i < scene.points.size(); ++i) {
      if (!ours.inlier[i]) continue;
      problem.observations.push_back({0, static_cast<int>(problem.points_in_world.size()), scene.observations[i]});
      problem.points_in_world.push_back(scene.points[i]);
    }
    CeresOracle ceres(kCamera, kBf, BundleOptions{.huber_mono_px = 1e9, .huber_depth_px = 1e9}, problem);
    ceres.fix_points();
    EXPECT_NEAR(ceres.solve(100, 1e-12), ours.cost, 1e-5 * ours.cost);
  }
}
#endif

}  // namespace
}  // namespace photoslam
