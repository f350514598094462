// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "optimization/bundle_adjustment.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "optimization/block_cholesky.h"
#include "optimization/synthetic_bundle.h"

#ifdef PHOTOSLAM_HAS_CERES
#include "optimization/ceres_oracle.h"
#endif

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = SyntheticBundle::kCamera;
constexpr double kBf = SyntheticBundle::kBf;

BundleOptions precise() { return {.max_iterations = 100, .relative_cost_tolerance = 1e-12}; }

TEST(BlockCholesky, SolvesASkylineSystem) {
  Random random(1);
  const std::vector<int> first_column = {0, 0, 1, 3, 0, 2, 5};
  constexpr int kSize = 42;
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(kSize, kSize);
  BlockCholesky<6> system;
  for (int repetition = 0; repetition < 2; ++repetition) {
    system.reset(first_column);
    dense.setZero();
    for (int row = 0; row < 7; ++row) {
      for (int column = first_column[static_cast<size_t>(row)]; column <= row; ++column) {
        for (int i = 0; i < 36; ++i) system.block(row, column)(i / 6, i % 6) = random.uniform(-1, 1);
        if (row == column) system.block(row, row).diagonal().array() += 30;
        dense.block<6, 6>(6 * row, 6 * column) = system.block(row, column);
      }
    }
    const Eigen::MatrixXd symmetric = dense.selfadjointView<Eigen::Lower>();
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(kSize, -1, 2);
    const Eigen::VectorXd expected = symmetric.ldlt().solve(x);
    ASSERT_TRUE(system.factorize());
    system.solve(x);
    EXPECT_LT((x - expected).norm(), 1e-12);
  }
}

TEST(BlockCholesky, RefusesAnIndefiniteMatrix) {
  BlockCholesky<6> system;
  const std::vector<int> first_column = {0, 0};
  system.reset(first_column);
  for (int i = 0; i < 2; ++i) system.block(i, i).setIdentity();
  system.block(1, 0).setIdentity();
  system.block(1, 0) *= 2;
  EXPECT_FALSE(system.factorize());
}

TEST(BundleAdjuster, RecoversTheTruthWithoutNoise) {
  for (double depth_share : {0.0, 1.0}) {
    // Without depth the scale is fixed by two poses.
    SyntheticBundle bundle({.noise_px = 0, .depth_share = depth_share, .num_fixed = 2});
    BundleAdjuster adjuster;
    const auto summary = adjuster.solve(precise(), kCamera, kBf, bundle.problem);
    EXPECT_GT(summary.initial_cost, 1000);
    EXPECT_LT(summary.final_cost, 1e-12);
    for (size_t i = 0; i < bundle.truth.camera_from_world.size(); ++i) {
      const SE3 error = bundle.problem.camera_from_world[i] * bundle.truth.camera_from_world[i].inverse();
      EXPECT_LT(error.log().norm(), 1e-7) << i;
    }
    std::vector<int> count(bundle.truth.points_in_world.size(), 0);
    for (const auto& o : bundle.truth.observations) ++count[static_cast<size_t>(o.point)];
    for (size_t i = 0; i < count.size(); ++i) {
      if (count[i] < 3) continue;
      EXPECT_LT((bundle.problem.points_in_world[i] - bundle.truth.points_in_world[i]).norm(), 1e-5) << i;
    }
  }
}

TEST(BundleAdjuster, FixedPosesAndUnseenPointsStay) {
  SyntheticBundle bundle({.num_fixed = 3});
  bundle.problem.points_in_world.push_back({1, 2, 3});
  bundle.problem.pose_is_fixed[7] = 1;
  const BundleProblem before = bundle.problem;
  BundleAdjuster adjuster;
  const auto summary = adjuster.solve({}, kCamera, kBf, bundle.problem);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
  EXPECT_EQ(bundle.problem.points_in_world.back(), before.points_in_world.back());
  for (size_t i = 0; i < before.camera_from_world.size(); ++i) {
    const bool same = bundle.problem.camera_from_world[i].matrix() == before.camera_from_world[i].matrix();
    EXPECT_EQ(same, before.pose_is_fixed[i]) << i;
  }
}

TEST(BundleAdjuster, HuberKeepsOutliersFromSpoilingTheResult) {
  SyntheticBundle bundle({.outlier_share = 0.05, .num_fixed = 2, .seed = 3});
  BundleAdjuster adjuster;
  adjuster.solve(precise(), kCamera, kBf, bundle.problem);
  for (size_t i = 0; i < bundle.truth.camera_from_world.size(); ++i) {
    const SE3 error = bundle.problem.camera_from_world[i] * bundle.truth.camera_from_world[i].inverse();
    EXPECT_LT(error.log().head<3>().norm(), 0.015) << i;
  }
}

TEST(BundleAdjuster, IgnoresWhatCannotBeUsed) {
  SyntheticBundle clean({.seed = 4});
  SyntheticBundle dirty({.seed = 4});
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  PixelObservation nan_pixel, infinite_depth, no_variance;
  nan_pixel.pixel.y() = kNan;
  infinite_depth.u_right = kInf;
  no_variance.inverse_variance = 0;
  const auto add_point = [&](const Vec3& point) {
    dirty.problem.points_in_world.push_back(point);
    return static_cast<int>(dirty.problem.points_in_world.size()) - 1;
  };
  for (const auto& pixel : {nan_pixel, infinite_depth, no_variance})
    dirty.problem.observations.push_back({3, 5, pixel});
  dirty.problem.observations.push_back({3, add_point(Vec3::Constant(kNan)), {}});
  const Vec3 behind = dirty.problem.camera_from_world[3].inverse() * Vec3(0, 0, -1);
  dirty.problem.observations.push_back({3, add_point(behind), {}});
  BundleAdjuster a, b;
  const auto expected = a.solve({}, kCamera, kBf, clean.problem);
  const auto summary = b.solve({}, kCamera, kBf, dirty.problem);
  EXPECT_EQ(summary.initial_cost, expected.initial_cost);
  EXPECT_EQ(summary.final_cost, expected.final_cost);
  EXPECT_EQ(dirty.problem.points_in_world.back(), behind);
}

TEST(BundleAdjuster, SurvivesProblemsWithoutFreePosesOrObservations) {
  BundleAdjuster adjuster;
  BundleProblem empty;
  EXPECT_EQ(adjuster.solve({}, kCamera, kBf, empty).final_cost, 0);
  SyntheticBundle structure({.noise_px = 0, .pose_error = 0, .num_fixed = 10});
  EXPECT_LT(adjuster.solve(precise(), kCamera, kBf, structure.problem).final_cost, 1e-12);
  SyntheticBundle lonely({});
  lonely.problem.observations.clear();
  const auto before = lonely.problem.camera_from_world[4].matrix();
  adjuster.solve({}, kCamera, kBf, lonely.problem);
  EXPECT_EQ(lonely.problem.camera_from_world[4].matrix(), before);
  BundleProblem bad;
  bad.observations.push_back({});
  EXPECT_THROW(adjuster.solve({}, kCamera, kBf, bad), CheckError);
}

TEST(BundleAdjuster, TheSamePoseMaySeeAPointTwice) {
  // Two observations with variance 2 are worth one with variance 1.
  SyntheticBundle once({.noise_px = 0.5, .seed = 5}), twice({.noise_px = 0.5, .seed = 5});
  for (auto& o : twice.problem.observations) o.pixel.inverse_variance *= 0.5;
  const auto copy = twice.problem.observations;
  twice.problem.observations.insert(twice.problem.observations.end(), copy.begin(), copy.end());
  BundleOptions options = precise();
  options.huber_mono_px = options.huber_depth_px = 1e6;
  BundleAdjuster adjuster;
  const double expected = adjuster.solve(options, kCamera, kBf, once.problem).final_cost;
  EXPECT_NEAR(adjuster.solve(options, kCamera, kBf, twice.problem).final_cost, expected, 1e-9 * expected);
}

TEST(BundleAdjuster, StopsWhenInterruptedWithTheBestStateSoFar) {
  SyntheticBundle bundle({});
  int questions = 0;
  BundleAdjuster adjuster;
  const auto summary = adjuster.solve(precise(), kCamera, kBf, bundle.problem, [&] { return ++questions > 2; });
  EXPECT_TRUE(summary.interrupted);
  EXPECT_EQ(summary.iterations, 2);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
  double cost = 0;
  for (const auto& o : bundle.problem.observations) {
    const double chi2 = reprojection_chi2(kCamera, kBf, bundle.problem.camera_from_world[static_cast<size_t>(o.pose)],
                                          bundle.problem.points_in_world[static_cast<size_t>(o.point)], o.pixel);
    const double delta = o.pixel.has_depth() ? 2.7955 : 2.4477;
    cost += 0.5 * (chi2 <= delta * delta ? chi2 : 2 * delta * std::sqrt(chi2) - delta * delta);
  }
  EXPECT_NEAR(cost, summary.final_cost, 1e-9 * cost);
}

TEST(BundleAdjuster, IsDeterministicAlsoWhenReused) {
  SyntheticBundle a({.seed = 6}), b({.seed = 6}), other({.num_poses = 6, .num_points = 900, .seed = 7});
  BundleAdjuster fresh, used;
  used.solve({}, kCamera, kBf, other.problem);
  fresh.solve({}, kCamera, kBf, a.problem);
  used.solve({}, kCamera, kBf, b.problem);
  for (size_t i = 0; i < a.problem.points_in_world.size(); ++i) {
    ASSERT_EQ(a.problem.points_in_world[i], b.problem.points_in_world[i]);
  }
}

TEST(ReprojectionChi2, IsInfiniteBehindTheCamera) {
  PixelObservation o;
  o.pixel = {kCamera.cx + 3, kCamera.cy};
  o.inverse_variance = 0.25;
  EXPECT_NEAR(reprojection_chi2(kCamera, kBf, SE3(), {0, 0, 2}, o), 9 * 0.25, 1e-12);
  o.u_right = kCamera.cx - kBf / 2 + 2;
  EXPECT_NEAR(reprojection_chi2(kCamera, kBf, SE3(), {0, 0, 2}, o), 13 * 0.25, 1e-12);
  EXPECT_EQ(reprojection_chi2(kCamera, kBf, SE3(), {0, 0, -2}, o), std::numeric_limits<double>::infinity());
}

#ifdef PHOTOSLAM_HAS_CERES
TEST(BundleAdjuster, AgreesWithCeres) {
  for (double depth_share : {0.0, 0.7}) {
    for (double outlier_share : {0.0, 0.05}) {
      SyntheticBundle bundle({.depth_share = depth_share, .outlier_share = outlier_share, .num_fixed = 2, .seed = 8});
      CeresOracle ceres(kCamera, kBf, precise(), bundle.problem);
      const double expected = ceres.solve(200, 1e-14);
      BundleAdjuster adjuster;
      const auto summary = adjuster.solve(precise(), kCamera, kBf, bundle.problem);
      EXPECT_NEAR(summary.final_cost, expected, 1e-6 * expected) << depth_share << " " << outlier_share;
      for (size_t i = 0; i < bundle.problem.camera_from_world.size(); ++i) {
        EXPECT_LT((bundle.problem.camera_from_world[i] * ceres.pose(i).inverse()).log().norm(), 1e-4);
      }
    }
  }
}
#endif

}  // namespace
}  // namespace photoslam
