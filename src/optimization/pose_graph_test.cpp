// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "optimization/pose_graph.h"

#include <gtest/gtest.h>

#include <set>

#include "base/random.h"
#ifdef PHOTOSLAM_HAS_CERES
#include <ceres/ceres.h>
#endif

namespace photoslam {
namespace {

Sim3 random_sim3(Random& random, double size, bool with_scale) {
  Vec7 tangent;
  for (int i = 0; i < 7; ++i) tangent[i] = size * random.normal();
  if (!with_scale) tangent[6] = 0;
  return Sim3::exp(tangent);
}

/// A round walk whose steps were measured with errors, and one exact edge that closes the circle.
struct Circle {
  static constexpr int kPoses = 40;
  std::vector<Sim3> truth;
  PoseGraph graph;

  Circle(bool with_scale, double noise, uint64_t seed = 1) {
    Random random(seed);
    for (int i = 0; i < kPoses; ++i) {
      const double angle = 2 * 3.14159265358979 * i / kPoses;
      truth.emplace_back(SE3(so3_exp(Vec3(0, angle, 0)), Vec3(3 * std::sin(angle), 0.1 * i, 0)));
    }
    graph.pose_from_world.push_back(truth[0]);
    for (size_t i = 1; i < truth.size(); ++i) {
      const Sim3 step = random_sim3(random, noise, with_scale) * truth[i] * truth[i - 1].inverse();
      graph.edges.push_back({static_cast<int>(i - 1), static_cast<int>(i), step});
      graph.pose_from_world.push_back(step * graph.pose_from_world.back());
    }
    graph.edges.push_back({kPoses - 1, 0, truth[0] * truth[kPoses - 1].inverse()});
    graph.pose_is_fixed.assign(kPoses, 0);
    graph.pose_is_fixed[0] = 1;
  }

  double error_of_last() const { return (graph.pose_from_world.back() * truth.back().inverse()).log().norm(); }
};

TEST(PoseGraph, DerivativesAgreeWithFiniteDifferences) {
  Random random(3);
  constexpr double kStep = 1e-6, kLength = 2.5;
  const Sim3 a = random_sim3(random, 0.7, true), b = random_sim3(random, 0.7, true);
  const Sim3 measured = random_sim3(random, 0.2, true) * b * a.inverse();
  const PoseGraphError error(measured, a, b, kLength);
  for (int i = 0; i < 7; ++i) {
    const Sim3 plus = Sim3::exp(kStep * Vec7::Unit(i)), minus = Sim3::exp(-kStep * Vec7::Unit(i));
    const Vec7 by_a =
        PoseGraphError(measured, plus * a, b, kLength).value - PoseGraphError(measured, minus * a, b, kLength).value;
    const Vec7 by_b =
        PoseGraphError(measured, a, plus * b, kLength).value - PoseGraphError(measured, a, minus * b, kLength).value;
    EXPECT_LT((error.by_a.col(i) - by_a / (2 * kStep)).norm(), 1e-7) << i;
    EXPECT_LT((error.by_b.col(i) - by_b / (2 * kStep)).norm(), 1e-7) << i;
  }
}

TEST(PoseGraph, ClosingTheCircleTakesBackTheDrift) {
  for (const bool with_scale : {false, true}) {
    Circle circle(with_scale, 0.01);
    const double before = circle.error_of_last();
    const auto summary = optimize_pose_graph({}, with_scale, 1.0, circle.graph);
    EXPECT_LT(circle.error_of_last(), 0.2 * before);
    EXPECT_LT(summary.final_cost, 0.1 * summary.initial_cost);
    if (!with_scale) {
      for (const Sim3& pose : circle.graph.pose_from_world) EXPECT_EQ(pose.scale, 1.0);
    }
  }
}

TEST(PoseGraph, ConsistentMeasurementsAreMetExactly) {
  Circle circle(true, 0.0);
  Random random(5);
  for (size_t i = 1; i < circle.truth.size(); ++i) {
    circle.graph.pose_from_world[i] = random_sim3(random, 0.1, true) * circle.graph.pose_from_world[i];
  }
  optimize_pose_graph({.max_iterations = 50, .relative_cost_tolerance = 0}, true, 1.0, circle.graph);
  for (size_t i = 0; i < circle.truth.size(); ++i) {
    EXPECT_LT((circle.graph.pose_from_world[i] * circle.truth[i].inverse()).log().norm(), 1e-7) << i;
  }
}

TEST(PoseGraph, FixedPosesStayAndAllFixedIsNoWork) {
  Circle circle(false, 0.02);
  const auto before = circle.graph.pose_from_world;
  circle.graph.pose_is_fixed.assign(Circle::kPoses, 1);
  EXPECT_EQ(optimize_pose_graph({}, false, 1.0, circle.graph).iterations, 0);
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(before[i].translation, circle.graph.pose_from_world[i].translation);
  }
}

TEST(PoseGraph, OrderIsAPermutationThatKeepsNeighboursClose) {
  // A ring in scrambled numbering: two neighbours each.
  constexpr int kCount = 100, kStride = 37;
  std::vector<std::vector<int>> neighbours(kCount);
  for (int i = 0; i < kCount; ++i) {
    const int a = i * kStride % kCount, b = (i + 1) * kStride % kCount;
    neighbours[static_cast<size_t>(a)].push_back(b);
    neighbours[static_cast<size_t>(b)].push_back(a);
  }
  const std::vector<int> order = bandwidth_reducing_order(neighbours);
  ASSERT_EQ(std::set<int>(order.begin(), order.end()).size(), size_t{kCount});
  std::vector<int> position(kCount);
  for (int i = 0; i < kCount; ++i) position[static_cast<size_t>(order[static_cast<size_t>(i)])] = i;
  for (int i = 0; i < kCount; ++i) {
    for (const int j : neighbours[static_cast<size_t>(i)]) {
      EXPECT_LE(std::abs(position[static_cast<size_t>(i)] - position[static_cast<size_t>(j)]), 2);
    }
  }
}

#ifdef PHOTOSLAM_HAS_CERES

/// The error of an edge for Ceres, as a function of the left tangents of both poses; differentiated numerically.
struct CeresEdge {
  PoseGraph::Edge edge;
  Sim3 a_from_world, b_from_world;
  bool operator()(const double* a, const double* b, double* residual) const {
    const Sim3 moved_a = Sim3::exp(Eigen::Map<const Vec7>(a)) * a_from_world;
    const Sim3 moved_b = Sim3::exp(Eigen::Map<const Vec7>(b)) * b_from_world;
    Eigen::Map<Vec7> r(residual);
    r = (edge.b_from_a * moved_a * moved_b.inverse()).log();
    r *= std::sqrt(edge.weight);
    return true;
  }
};

TEST(PoseGraph, ReachesTheCostOfCeres) {
  for (const uint64_t seed : {1u, 2u, 3u}) {
    Circle circle(true, 0.02, seed);
    circle.graph.edges.back().weight = 5;
    circle.graph.edges.push_back({5, 25, circle.truth[25] * circle.truth[5].inverse(), 0.5});
    std::vector<Vec7> tangents(Circle::kPoses, Vec7::Zero());
    ceres::Problem problem;
    for (const PoseGraph::Edge& edge : circle.graph.edges) {
      auto* error = new CeresEdge{edge, circle.graph.pose_from_world[static_cast<size_t>(edge.a)],
                                  circle.graph.pose_from_world[static_cast<size_t>(edge.b)]};
      problem.AddResidualBlock(new ceres::NumericDiffCostFunction<CeresEdge, ceres::CENTRAL, 7, 7, 7>(error), nullptr,
                               tangents[static_cast<size_t>(edge.a)].data(),
                               tangents[static_cast<size_t>(edge.b)].data());
    }
    problem.SetParameterBlockConstant(tangents[0].data());
    ceres::Solver::Options options;
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-14;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary ceres_summary;
    ceres::Solve(options, &problem, &ceres_summary);
    const auto summary =
        optimize_pose_graph({.max_iterations = 100, .relative_cost_tolerance = 1e-14}, true, 1.0, circle.graph);
    EXPECT_NEAR(summary.initial_cost, ceres_summary.initial_cost, 1e-9 * summary.initial_cost);
    EXPECT_LT(summary.final_cost, ceres_summary.final_cost * (1 + 1e-6)) << seed;
    EXPECT_GT(summary.final_cost, ceres_summary.final_cost * (1 - 1e-6)) << seed;
  }
}

#endif

}  // namespace
}  // namespace photoslam
