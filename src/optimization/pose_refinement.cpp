// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "optimization/pose_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "base/check.h"
#include "optimization/reprojection.h"

namespace photoslam {
namespace {

constexpr int kMinInliers = 4;

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// ½ Σ ρ at a pose, with gradient and Gauss-Newton Hessian by a left twist.
struct Linearization {
  double cost = 0;
  Mat6 hessian = Mat6::Zero();  // lower triangle
  Vec6 gradient = Vec6::Zero();
};

class Refiner {
 public:
  Refiner(const PoseRefinementOptions& options, const PinholeCamera& camera, double bf, std::span<const Vec3> points,
          std::span<const PixelObservation> observations)
      : options_(options), camera_(camera), bf_(bf), points_(points), observations_(observations) {}

  /// χ² of an observation; infinite when it cannot be used.
  double chi2(size_t i, const Mat3& rotation, const Vec3& translation) const {
    const Vec3 x = rotation * points_[i] + translation;
    if (!is_usable(observations_[i]) || !(x.z() > 0)) return std::numeric_limits<double>::infinity();
    const double value = Reprojection(camera_, bf_, x, observations_[i]).chi2(observations_[i]);
    return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
  }

  double threshold(size_t i) const { return observations_[i].has_depth() ? options_.chi2_depth : options_.chi2_mono; }

  int select(const SE3& pose, bool all_in_front, std::vector<uint8_t>& inlier) const {
    const Mat3 rotation = pose.matrix3();
    int count = 0;
    for (size_t i = 0; i < points_.size(); ++i) {
      const double value = chi2(i, rotation, pose.translation);
      inlier[i] = all_in_front ? std::isfinite(value) : value <= threshold(i);
      count += inlier[i];
    }
    return count;
  }

  /// Over the selected observations; infinite cost when one of them lies behind the camera.
  Linearization linearize(const SE3& pose, const std::vector<uint8_t>& inlier, bool robust) const {
    Linearization result;
    const Mat3 rotation = pose.matrix3();
    for (size_t i = 0; i < points_.size(); ++i) {
      if (!inlier[i]) continue;
      const Vec3 x = rotation * points_[i] + pose.translation;
      if (!(x.z() > 0)) {
        result.cost = std::numeric_limits<double>::infinity();
        return result;
      }
      const PixelObservation& observation = observations_[i];
      const Reprojection reprojection(camera_, bf_, x, observation);
      const double delta = robust ? std::sqrt(threshold(i)) : std::numeric_limits<double>::infinity();
      const HuberLoss loss(reprojection.chi2(observation), delta);
      result.cost += 0.5 * loss.value;
      const PointDerivatives derivatives(camera_, bf_, observation, reprojection,
                                         loss.weight * observation.inverse_variance);
      result.gradient += gradient_by_twist(x, derivatives.gradient);
      add_hessian_by_twist(x, derivatives.hessian, result.hessian);
    }
    return result;
  }

  /// Levenberg-Marquardt over the selected observations; returns the cost and moves `pose`.
  double minimize(const std::vector<uint8_t>& inlier, bool robust, SE3& pose) const {
    constexpr double kRelativeTolerance = 1e-6;
    Linearization current = linearize(pose, inlier, robust);
    double damping = 1e-6, growth = 2;
    for (int i = 0; i < options_.iterations_per_round; ++i) {
      Mat6 damped = current.hessian;
      damped.diagonal() += (damping * current.hessian.diagonal().array().max(1e-9)).matrix();
      const Vec6 step = -damped.ldlt().solve(current.gradient);
      if (!step.allFinite()) break;
      const SE3 candidate = SE3::exp(step) * pose;
      const Linearization next = linearize(candidate, inlier, robust);
      if (next.cost < current.cost) {
        const bool converged = current.cost - next.cost < kRelativeTolerance * current.cost;
        pose = candidate;
        current = next;
        damping = std::max(damping * 0.1, 1e-12);
        growth = 2;
        if (converged) break;
      } else {
        // At the minimum rounding decides; a predicted decrease this small cannot be found by a shorter step either.
        if (-current.gradient.dot(step) < 1e-9 * current.cost) break;
        damping = std::max(damping, 1e-6) * growth;
        growth *= 4;
      }
    }
    return current.cost;
  }

 private:
  const PoseRefinementOptions& options_;
  const PinholeCamera& camera_;
  double bf_;
  std::span<const Vec3> points_;
  std::span<const PixelObservation> observations_;
};

}  // namespace

void PoseRefinementOptions::visit(OptionVisitor& visitor) {
  visitor.value({"rounds", "", 1, 10, "Inliers are chosen anew after each round; the last one is not robust."}, rounds);
  visitor.value({"iterations_per_round", "", 1, 100, "At most so many Levenberg-Marquardt steps per round."},
                iterations_per_round);
  visitor.value({"chi2_mono", "", 0.1, 100, "Squared error over variance up to which an observation is an inlier."},
                chi2_mono);
  visitor.value({"chi2_depth", "", 0.1, 100, "The same for observations with depth, which have three coordinates."},
                chi2_depth);
}

PoseRefinementResult refine_pose(const PoseRefinementOptions& options, const PinholeCamera& camera, double bf,
                                 std::span<const Vec3> points_in_world, std::span<const PixelObservation> observations,
                                 const SE3& initial_camera_from_world) {
  PHOTOSLAM_CHECK(points_in_world.size() == observations.size(), "{} points, {} observations", points_in_world.size(),
                  observations.size());
  const Refiner refiner(options, camera, bf, points_in_world, observations);
  PoseRefinementResult result;
  result.camera_from_world = initial_camera_from_world;
  result.inlier.resize(points_in_world.size());
  SE3 pose = initial_camera_from_world;
  int count = refiner.select(pose, true, result.inlier);
  for (int round = 0; round < options.rounds && count >= kMinInliers; ++round) {
    const bool last = round + 1 == options.rounds;
    result.cost = refiner.minimize(result.inlier, !last, pose);
    count = refiner.select(pose, false, result.inlier);
  }
  result.num_inliers = count;
  result.converged = count >= kMinInliers && pose.translation.allFinite() && pose.rotation.coeffs().allFinite();
  if (result.converged) result.camera_from_world = pose;
  return result;
}

}  // namespace photoslam
