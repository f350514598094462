// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include "optimization/bundle_adjustment.h"
#include "optimization/synthetic_bundle.h"

#ifdef PHOTOSLAM_HAS_CERES
#include "optimization/ceres_oracle.h"
#endif

namespace photoslam {
namespace {

/// Poses and points of a local and of a large window; a fifth of the poses is the fixed ring.
SyntheticBundle window(const benchmark::State& state) {
  return SyntheticBundle({.num_poses = static_cast<int>(state.range(0)),
                          .num_points = static_cast<int>(state.range(1)),
                          .outlier_share = 0.02,
                          .num_fixed = static_cast<int>(state.range(0)) / 5});
}

/// Both solvers stop when a step improves the cost by less than this share.
constexpr double kTolerance = 1e-6;
constexpr int kMaxIterations = 50;

void windows(benchmark::internal::Benchmark* b) {
  b->Args({20, 2000})->Args({80, 10000})->Unit(benchmark::kMillisecond);
}

void report(benchmark::State& state, const SyntheticBundle& bundle, double cost, int iterations) {
  state.counters["cost"] = cost;
  state.counters["iterations"] = iterations;
  state.counters["observations"] = static_cast<double>(bundle.problem.observations.size());
}

void bundle_adjuster(benchmark::State& state) {
  const SyntheticBundle bundle = window(state);
  BundleAdjuster adjuster;
  BundleSummary summary;
  for (auto _ : state) {
    state.PauseTiming();
    BundleProblem problem = bundle.problem;
    state.ResumeTiming();
    summary = adjuster.solve({.max_iterations = kMaxIterations, .relative_cost_tolerance = kTolerance},
                             SyntheticBundle::kCamera, SyntheticBundle::kBf, problem);
  }
  report(state, bundle, summary.final_cost, summary.iterations);
}
BENCHMARK(bundle_adjuster)->Apply(windows);

#ifdef PHOTOSLAM_HAS_CERES
template <ceres::LinearSolverType kSolver>
void ceres_solver(benchmark::State& state) {
  const SyntheticBundle bundle = window(state);
  double cost = 0;
  int iterations = 0;
  for (auto _ : state) {
    state.PauseTiming();
    CeresOracle oracle(SyntheticBundle::kCamera, SyntheticBundle::kBf, BundleOptions(), bundle.problem);
    state.ResumeTiming();
    cost = oracle.solve(kMaxIterations, kTolerance, kSolver);
    iterations = oracle.iterations();
  }
  report(state, bundle, cost, iterations);
}
BENCHMARK(ceres_solver<ceres::DENSE_SCHUR>)->Apply(windows);
BENCHMARK(ceres_solver<ceres::SPARSE_SCHUR>)->Apply(windows);
#endif

void pose_refinement(benchmark::State& state) {
  const int count = static_cast<int>(state.range(0));
  Random random(1);
  std::vector<Vec3> points;
  std::vector<PixelObservation> observations;
  for (int i = 0; i < count; ++i) {
    const Vec2 pixel(random.uniform(0, 639), random.uniform(0, 479));
    const double z = random.uniform(1, 5);
    points.push_back(SyntheticBundle::kCamera.unproject(pixel, z));
    PixelObservation o;
    o.pixel = pixel + Vec2(random.normal(), random.normal());
    o.u_right = pixel.x() - SyntheticBundle::kBf / z + random.normal();
    if (i % 5 == 0) o.pixel = Vec2(random.uniform(0, 639), random.uniform(0, 479));
    observations.push_back(o);
  }
  Vec6 twist;
  twist << 0.03, -0.02, 0.02, 0.01, 0.02, -0.01;
  PoseRefinementResult result;
  for (auto _ : state) {
    result = refine_pose({}, SyntheticBundle::kCamera, SyntheticBundle::kBf, points, observations, SE3::exp(twist));
  }
  state.counters["inliers"] = result.num_inliers;
}
BENCHMARK(pose_refinement)->Arg(300)->Arg(1000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace photoslam
