// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <vector>

#include "optimization/bundle_adjustment.h"

namespace photoslam {

/// The same least-squares problem posed to Ceres, with automatic derivatives: an independent opinion for the tests and
/// a yardstick for the benchmark. All points must lie in front of the cameras.
class CeresOracle {
 public:
  CeresOracle(const PinholeCamera& camera, double bf, const BundleOptions& options, const BundleProblem& problem) {
    for (const SE3& pose : problem.camera_from_world) {
      const Vec3 rotation = so3_log(pose.rotation), &translation = pose.translation;
      poses_.push_back({rotation.x(), rotation.y(), rotation.z(), translation.x(), translation.y(), translation.z()});
    }
    for (const Vec3& point : problem.points_in_world) points_.push_back({point.x(), point.y(), point.z()});
    for (const auto& o : problem.observations) {
      double* pose = poses_[static_cast<size_t>(o.pose)].data();
      double* point = points_[static_cast<size_t>(o.point)].data();
      if (o.pixel.has_depth()) {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<Residual<3>, 3, 6, 3>(new Residual<3>{camera, bf, o.pixel}),
            new ceres::HuberLoss(options.huber_depth_px), pose, point);
      } else {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<Residual<2>, 2, 6, 3>(new Residual<2>{camera, bf, o.pixel}),
            new ceres::HuberLoss(options.huber_mono_px), pose, point);
      }
    }
    for (size_t i = 0; i < poses_.size(); ++i) {
      if (problem.pose_is_fixed[i] && problem_.HasParameterBlock(poses_[i].data())) {
        problem_.SetParameterBlockConstant(poses_[i].data());
      }
    }
  }

  void fix_points() {
    for (auto& point : points_) problem_.SetParameterBlockConstant(point.data());
  }

  /// Returns the final cost, ½ Σ ρ.
  double solve(int max_iterations, double relative_cost_tolerance,
               ceres::LinearSolverType solver = ceres::DENSE_SCHUR) {
    ceres::Solver::Options options;
    options.linear_solver_type = solver;
    options.num_threads = 1;
    options.max_num_iterations = max_iterations;
    options.function_tolerance = relative_cost_tolerance;
    options.gradient_tolerance = options.parameter_tolerance = 0;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    iterations_ = static_cast<int>(summary.iterations.size()) - 1;
    return summary.final_cost;
  }

  int iterations() const { return iterations_; }
  SE3 pose(size_t i) const {
    const auto& p = poses_[i];
    return {so3_exp({p[0], p[1], p[2]}), {p[3], p[4], p[5]}};
  }

 private:
  template <int kRows>
  struct Residual {
    PinholeCamera camera;
    double bf;
    PixelObservation observation;

    template <class T>
    bool operator()(const T* pose, const T* point, T* residual) const {
      T x[3];
      ceres::AngleAxisRotatePoint(pose, point, x);
      for (int i = 0; i < 3; ++i) x[i] += pose[3 + i];
      const double weight = std::sqrt(observation.inverse_variance);
      const T u = camera.fx * x[0] / x[2] + camera.cx;
      residual[0] = weight * (u - observation.pixel.x());
      residual[1] = weight * (camera.fy * x[1] / x[2] + camera.cy - observation.pixel.y());
      if constexpr (kRows == 3) residual[2] = weight * (u - bf / x[2] - observation.u_right);
      return true;
    }
  };

  std::vector<std::array<double, 6>> poses_;
  std::vector<std::array<double, 3>> points_;
  ceres::Problem problem_;
  int iterations_ = 0;
};

}  // namespace photoslam
