// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/similarity_ransac.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/random.h"
#include "math/umeyama.h"

namespace photoslam {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Normal equations of the seven tangents.
struct NormalEquations {
  Mat7 hessian = Mat7::Zero();
  Vec7 gradient = Vec7::Zero();

  /// `by_tangent`: derivative of the point x in the camera frame.
  void add(const PinholeCamera& camera, const Vec3& x, const Vec2& pixel, double sigma,
           const Eigen::Matrix<double, 3, 7>& by_tangent) {
    const double iz = 1 / x.z();
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << camera.fx * iz, 0, -camera.fx * x.x() * iz * iz, 0, camera.fy * iz, -camera.fy * x.y() * iz * iz;
    const Eigen::Matrix<double, 2, 7> jacobian = by_point * by_tangent / sigma;
    hessian += jacobian.transpose() * jacobian;
    gradient += jacobian.transpose() * (camera.project(x) - pixel) / sigma;
  }
};

Eigen::Matrix<double, 3, 7> by_left_tangent(const Vec3& x) {
  Eigen::Matrix<double, 3, 7> m;
  m << Mat3::Identity(), -hat(x), x;
  return m;
}

class Estimator {
 public:
  Estimator(const SimilarityRansacOptions& options, const PinholeCamera& camera, bool with_scale,
            std::span<const PointMatch> matches)
      : options_(options), camera_(camera), with_scale_(with_scale), matches_(matches) {}

  Sim3 search() const {
    Random random(static_cast<uint64_t>(options_.seed));
    Sim3 best;
    double best_cost = kInfinity;
    int needed = options_.max_iterations;
    for (int iteration = 0; iteration < needed; ++iteration) {
      const Sim3 candidate = align_sample(random);
      const double candidate_cost = cost(candidate);
      if (candidate_cost >= best_cost) continue;
      best = candidate;
      best_cost = candidate_cost;
      // Local optimisation: a sample of three is noisy, the inliers it finds are not.
      if (const Sim3 refined = refine(candidate, 2); cost(refined) < best_cost) {
        best = refined;
        best_cost = cost(refined);
      }
      needed = std::min(options_.max_iterations, iterations_needed(best));
    }
    return best;
  }

  Sim3 refine(Sim3 b_from_a, int rounds) const {
    for (int round = 0; round < rounds; ++round) {
      const Sim3 a_from_b = b_from_a.inverse();
      NormalEquations equations;
      for (const PointMatch& match : matches_) {
        if (error(b_from_a, a_from_b, match) > 1) continue;
        const Vec3 in_b = b_from_a * match.point_in_a, in_a = a_from_b * match.point_in_b;
        equations.add(camera_, in_b, match.pixel_in_b, match.sigma_b, by_left_tangent(in_b));
        // The inverse moves by −ξ on the right: a_from_b exp(−ξ) x.
        const Mat3 turn = -a_from_b.scale * a_from_b.rotation.toRotationMatrix();
        equations.add(camera_, in_a, match.pixel_in_a, match.sigma_a, turn * by_left_tangent(match.point_in_b));
      }
      if (!with_scale_) {
        equations.hessian.row(6).setZero();
        equations.hessian.col(6).setZero();
        equations.hessian(6, 6) = 1;
        equations.gradient[6] = 0;
      }
      const Vec7 step = -equations.hessian.ldlt().solve(equations.gradient);
      if (!step.allFinite() || step.norm() > 10) break;
      b_from_a = Sim3::exp(step) * b_from_a;
    }
    return b_from_a;
  }

  SimilarityResult judge(const Sim3& b_from_a) const {
    SimilarityResult result;
    result.b_from_a = b_from_a;
    const Sim3 a_from_b = b_from_a.inverse();
    for (const PointMatch& match : matches_) {
      result.inlier.push_back(error(b_from_a, a_from_b, match) <= 1);
      result.num_inliers += result.inlier.back();
    }
    result.success = result.num_inliers >= options_.min_inliers;
    return result;
  }

 private:
  Sim3 align_sample(Random& random) const {
    std::array<Vec3, 3> in_a, in_b;
    for (size_t k = 0; k < 3; ++k) {
      const PointMatch& match = matches_[static_cast<size_t>(random.index(static_cast<int>(matches_.size())))];
      in_a[k] = match.point_in_a;
      in_b[k] = match.point_in_b;
    }
    return align_umeyama(in_a, in_b, with_scale_);
  }

  /// Worse squared reprojection error of both images relative to the threshold; infinite behind a camera.
  double error(const Sim3& b_from_a, const Sim3& a_from_b, const PointMatch& match) const {
    const Vec3 in_b = b_from_a * match.point_in_a, in_a = a_from_b * match.point_in_b;
    if (!(in_b.z() > 0) || !(in_a.z() > 0)) return kInfinity;
    const double error_b = (camera_.project(in_b) - match.pixel_in_b).norm() / match.sigma_b;
    const double error_a = (camera_.project(in_a) - match.pixel_in_a).norm() / match.sigma_a;
    const double worse = std::max(error_a, error_b);
    return worse * worse / options_.max_chi2;
  }

  /// Truncated squared error, so that among equal counts the better fit wins (MSAC).
  double cost(const Sim3& b_from_a) const {
    if (!(b_from_a.scale > 1e-6)) return kInfinity;
    const Sim3 a_from_b = b_from_a.inverse();
    double sum = 0;
    for (const PointMatch& match : matches_) sum += std::min(1.0, error(b_from_a, a_from_b, match));
    return sum;
  }

  int iterations_needed(const Sim3& b_from_a) const {
    const double share = judge(b_from_a).num_inliers / static_cast<double>(matches_.size());
    const double good_sample = share * share * share;
    if (good_sample >= 1) return 1;
    if (good_sample <= 0) return options_.max_iterations;
    return static_cast<int>(std::min(std::log(1 - options_.confidence) / std::log(1 - good_sample), 1e9)) + 1;
  }

  const SimilarityRansacOptions& options_;
  const PinholeCamera& camera_;
  bool with_scale_;
  std::span<const PointMatch> matches_;
};

constexpr int kFinalRounds = 5;

}  // namespace

void SimilarityRansacOptions::visit(OptionVisitor& v) {
  v.value({"max_iterations", "", 1, 100000, "Samples of three matches."}, max_iterations);
  v.value({"min_inliers", "", 4, 1000, "Fewer agreeing matches count as a failure."}, min_inliers);
  v.value({"max_chi2", "", 0.1, 1000, "Squared reprojection error, in σ², up to which a match agrees."}, max_chi2);
  v.value({"confidence", "", 0.5, 1, "Stops when a better transform was missed with a probability below 1 − this."},
          confidence);
  v.value({"seed", "", 0, 1e9, "Seed of the sampling."}, seed);
}

SimilarityResult estimate_similarity_ransac(const SimilarityRansacOptions& options, const PinholeCamera& camera,
                                            bool with_scale, std::span<const PointMatch> matches) {
  const Estimator estimator(options, camera, with_scale, matches);
  if (static_cast<int>(matches.size()) < std::max(3, options.min_inliers)) {
    return {.success = false, .b_from_a = {}, .inlier = std::vector<uint8_t>(matches.size(), 0), .num_inliers = 0};
  }
  return estimator.judge(estimator.refine(estimator.search(), kFinalRounds));
}

SimilarityResult refine_similarity(const SimilarityRansacOptions& options, const PinholeCamera& camera, bool with_scale,
                                   std::span<const PointMatch> matches, const Sim3& initial_b_from_a) {
  const Estimator estimator(options, camera, with_scale, matches);
  return estimator.judge(estimator.refine(initial_b_from_a, kFinalRounds));
}

}  // namespace photoslam
