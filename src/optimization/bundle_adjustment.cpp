// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "optimization/bundle_adjustment.h"

#include <algorithm>

#include "base/check.h"
#include "optimization/block_cholesky.h"
#include "optimization/reprojection.h"

namespace photoslam {
namespace {

using Mat63 = Eigen::Matrix<double, 6, 3>;
using Block = BlockCholesky<6>::Block;

constexpr int kFixed = -1;

/// An observation that takes part.
struct Term {
  PixelObservation pixel;
  int pose;       // In the problem.
  int free_pose;  // Among the poses that change, kFixed for the others.
};

/// A point with the range of its terms, which are sorted by pose, and its part of the normal equations.
struct PointTerms {
  int point;
  int begin, end;
  Mat3 hessian;
  Vec3 gradient;
  Mat3 inverse_hessian;  // Damped.
  Vec3 step;
};

/// What scales the damping. The bound keeps directions that nothing observes where they are.
template <class Diagonal>
auto damping_scale(const Diagonal& diagonal) {
  return diagonal.array().max(1e-6);
}

double huber_delta(const BundleOptions& options, const PixelObservation& observation) {
  return observation.has_depth() ? options.huber_depth_px : options.huber_mono_px;
}

/// ρ of a term whose point went behind its camera: large enough to reject such a step unless all others gain by it.
double behind_camera_loss(double delta) { return HuberLoss(1e6, delta).value; }

}  // namespace

struct BundleAdjuster::State {
  BundleOptions options;
  PinholeCamera camera;
  double bf = 0;

  // The problem in solving order.
  std::vector<Term> terms;
  std::vector<PointTerms> points;
  std::vector<int> free_index;    // [P], kFixed for the fixed poses
  std::vector<int> free_poses;    // [F] in the problem
  std::vector<int> first_column;  // [F] first pose that shares a point with this one
  std::vector<int> point_end;     // Scratch [M + 1]

  // Normal equations: pose blocks, pose-point blocks (the point blocks are in `points`), reduced camera system.
  std::vector<Block> pose_hessian;  // [F] lower triangles
  std::vector<Mat63> coupling;      // [terms]
  BlockCholesky<6> system;
  Eigen::VectorXd gradient, step;  // [6 F]

  std::vector<Mat3> rotations;  // [P] of the poses last evaluated
  std::vector<SE3> candidate_poses;
  std::vector<Vec3> candidate_points;

  void prepare(const BundleProblem& problem);
  void sort_terms(const BundleProblem& problem);
  void set_rotations(const std::vector<SE3>& poses);
  double cost(const std::vector<SE3>& poses, const std::vector<Vec3>& positions);
  void linearize(const BundleProblem& problem);
  void linearize_point(const BundleProblem& problem, PointTerms& point);
  void eliminate(PointTerms& point, double damping);
  bool solve_step(double damping);
  double predicted_decrease(double damping) const;
  void apply_step(const BundleProblem& problem);
};

void BundleAdjuster::State::prepare(const BundleProblem& problem) {
  PHOTOSLAM_CHECK(problem.pose_is_fixed.size() == problem.camera_from_world.size(), "{} flags, {} poses",
                  problem.pose_is_fixed.size(), problem.camera_from_world.size());
  free_poses.clear();
  free_index.clear();
  for (size_t i = 0; i < problem.camera_from_world.size(); ++i) {
    const bool fixed = problem.pose_is_fixed[i];
    free_index.push_back(fixed ? kFixed : static_cast<int>(free_poses.size()));
    if (!fixed) free_poses.push_back(static_cast<int>(i));
  }
  sort_terms(problem);

  first_column.resize(free_poses.size());
  for (size_t i = 0; i < free_poses.size(); ++i) first_column[i] = static_cast<int>(i);
  for (const PointTerms& point : points) {
    int first = kFixed;
    for (int t = point.begin; t < point.end; ++t) {
      const int pose = terms[static_cast<size_t>(t)].free_pose;
      if (pose == kFixed) continue;
      if (first == kFixed) first = pose;
      first_column[static_cast<size_t>(pose)] = std::min(first_column[static_cast<size_t>(pose)], first);
    }
  }
  coupling.resize(terms.size());
  pose_hessian.resize(free_poses.size());
  gradient.resize(6 * static_cast<Eigen::Index>(free_poses.size()));
  step.resize(gradient.size());
}

void BundleAdjuster::State::sort_terms(const BundleProblem& problem) {
  // Counting sort by point of the observations that can take part.
  const auto takes_part = [&problem](const BundleProblem::Observation& o) {
    const Vec3 x =
        problem.camera_from_world[static_cast<size_t>(o.pose)] * problem.points_in_world[static_cast<size_t>(o.point)];
    return is_usable(o.pixel) && x.allFinite() && x.z() > 0;
  };
  point_end.assign(problem.points_in_world.size() + 1, 0);
  for (const auto& o : problem.observations) {
    PHOTOSLAM_CHECK(o.pose >= 0 && o.pose < static_cast<int>(problem.camera_from_world.size()) && o.point >= 0 &&
                        o.point < static_cast<int>(problem.points_in_world.size()),
                    "pose {}, point {}", o.pose, o.point);
    if (takes_part(o)) ++point_end[static_cast<size_t>(o.point) + 1];
  }
  for (size_t i = 1; i < point_end.size(); ++i) point_end[i] += point_end[i - 1];
  points.clear();
  for (size_t i = 0; i + 1 < point_end.size(); ++i) {
    if (point_end[i + 1] == point_end[i]) continue;
    points.emplace_back();
    points.back().point = static_cast<int>(i);
    points.back().begin = point_end[i];
    points.back().end = point_end[i + 1];
  }
  terms.resize(static_cast<size_t>(point_end.back()));
  for (const auto& o : problem.observations) {
    if (!takes_part(o)) continue;
    auto& position = point_end[static_cast<size_t>(o.point)];
    terms[static_cast<size_t>(position++)] = {o.pixel, o.pose, free_index[static_cast<size_t>(o.pose)]};
  }
  // Stable: equal input gives equal bits, whatever the library.
  for (const PointTerms& point : points) {
    for (int i = point.begin + 1; i < point.end; ++i) {
      for (int k = i; k > point.begin && terms[static_cast<size_t>(k)].pose < terms[static_cast<size_t>(k - 1)].pose;
           --k) {
        std::swap(terms[static_cast<size_t>(k)], terms[static_cast<size_t>(k - 1)]);
      }
    }
  }
}

void BundleAdjuster::State::set_rotations(const std::vector<SE3>& poses) {
  rotations.resize(poses.size());
  for (size_t i = 0; i < poses.size(); ++i) rotations[i] = poses[i].matrix3();
}

double BundleAdjuster::State::cost(const std::vector<SE3>& poses, const std::vector<Vec3>& positions) {
  set_rotations(poses);
  double sum = 0;
  for (const PointTerms& point : points) {
    const Vec3& position = positions[static_cast<size_t>(point.point)];
    for (int t = point.begin; t < point.end; ++t) {
      const Term& term = terms[static_cast<size_t>(t)];
      const auto pose = static_cast<size_t>(term.pose);
      const Vec3 x = rotations[pose] * position + poses[pose].translation;
      const double delta = huber_delta(options, term.pixel);
      sum += x.z() > 0 ? HuberLoss(Reprojection(camera, bf, x, term.pixel).chi2(term.pixel), delta).value
                       : behind_camera_loss(delta);
    }
  }
  return 0.5 * sum;
}

/// With x = R p + t and A, b the derivatives by x: the blocks of the twist follow from dx = v + ω × x, those of the
/// point from dx = R dp.
void BundleAdjuster::State::linearize_point(const BundleProblem& problem, PointTerms& point) {
  const Vec3& position = problem.points_in_world[static_cast<size_t>(point.point)];
  point.hessian.setZero();
  point.gradient.setZero();
  for (int t = point.begin; t < point.end; ++t) {
    const Term& term = terms[static_cast<size_t>(t)];
    const Mat3& rotation = rotations[static_cast<size_t>(term.pose)];
    const Vec3 x = rotation * position + problem.camera_from_world[static_cast<size_t>(term.pose)].translation;
    Mat63& w = coupling[static_cast<size_t>(t)];
    if (!(x.z() > 0)) {
      w.setZero();
      continue;
    }
    const Reprojection reprojection(camera, bf, x, term.pixel);
    const HuberLoss loss(reprojection.chi2(term.pixel), huber_delta(options, term.pixel));
    const PointDerivatives by_x(camera, bf, term.pixel, reprojection, loss.weight * term.pixel.inverse_variance);
    const Mat3 by_x_and_point = by_x.hessian * rotation;
    point.hessian += rotation.transpose() * by_x_and_point;
    point.gradient += rotation.transpose() * by_x.gradient;
    if (term.free_pose == kFixed) continue;
    w.topRows<3>() = by_x_and_point;
    w.bottomRows<3>() = cross_columns(x, by_x_and_point);
    add_hessian_by_twist(x, by_x.hessian, pose_hessian[static_cast<size_t>(term.free_pose)]);
    gradient.segment<6>(6 * term.free_pose) += gradient_by_twist(x, by_x.gradient);
  }
}

void BundleAdjuster::State::linearize(const BundleProblem& problem) {
  set_rotations(problem.camera_from_world);
  std::fill(pose_hessian.begin(), pose_hessian.end(), Block::Zero());
  gradient.setZero();
  for (PointTerms& point : points) linearize_point(problem, point);
}

/// Schur complement: takes one point out of the system, at the cost of coupling all poses that see it.
void BundleAdjuster::State::eliminate(PointTerms& point, double damping) {
  Mat3 damped = point.hessian;
  damped.diagonal().array() += damping * damping_scale(point.hessian.diagonal());
  point.inverse_hessian = damped.inverse();
  for (int t = point.begin; t < point.end; ++t) {
    const int row = terms[static_cast<size_t>(t)].free_pose;
    if (row == kFixed) continue;
    const Mat63 scaled = coupling[static_cast<size_t>(t)] * point.inverse_hessian;
    step.segment<6>(6 * row) += scaled * point.gradient;
    for (int other = point.begin; other <= t; ++other) {
      const int column = terms[static_cast<size_t>(other)].free_pose;
      if (column == kFixed) continue;
      Block& block = system.block(row, column);
      const Mat63& w = coupling[static_cast<size_t>(other)];
      for (int j = 0; j < 6; ++j) {
        block.col(j) -= w(j, 0) * scaled.col(0) + w(j, 1) * scaled.col(1) + w(j, 2) * scaled.col(2);
      }
      // The same pose twice: the pair and its mirror image.
      if (column == row && other < t) block.noalias() -= w * scaled.transpose();
    }
  }
}

/// Solves the damped normal equations for `step` of the poses and of every point.
bool BundleAdjuster::State::solve_step(double damping) {
  system.reset(first_column);
  for (int i = 0; i < system.size(); ++i) {
    Block& block = system.block(i, i);
    block = pose_hessian[static_cast<size_t>(i)];
    block.diagonal().array() += damping * damping_scale(pose_hessian[static_cast<size_t>(i)].diagonal());
  }
  step = -gradient;
  for (PointTerms& point : points) eliminate(point, damping);
  if (!system.factorize()) return false;
  system.solve(step);
  for (PointTerms& point : points) {
    Vec3 sum = point.gradient;
    for (int t = point.begin; t < point.end; ++t) {
      const int pose = terms[static_cast<size_t>(t)].free_pose;
      if (pose != kFixed) sum += coupling[static_cast<size_t>(t)].transpose() * step.segment<6>(6 * pose);
    }
    point.step = -(point.inverse_hessian * sum);
  }
  return step.allFinite();
}

/// Of the quadratic model: −gᵀd − ½ dᵀH d = ½ (λ dᵀD d − gᵀd), as (H + λ D) d = −g.
double BundleAdjuster::State::predicted_decrease(double damping) const {
  double sum = -gradient.dot(step);
  for (size_t i = 0; i < pose_hessian.size(); ++i) {
    const auto d = step.segment<6>(6 * static_cast<Eigen::Index>(i)).array();
    sum += damping * (damping_scale(pose_hessian[i].diagonal()) * d * d).sum();
  }
  for (const PointTerms& point : points) {
    sum += damping * (damping_scale(point.hessian.diagonal()) * point.step.array().square()).sum() -
           point.gradient.dot(point.step);
  }
  return 0.5 * sum;
}

void BundleAdjuster::State::apply_step(const BundleProblem& problem) {
  candidate_poses = problem.camera_from_world;
  candidate_points = problem.points_in_world;
  for (size_t i = 0; i < free_poses.size(); ++i) {
    SE3& pose = candidate_poses[static_cast<size_t>(free_poses[i])];
    pose = SE3::exp(step.segment<6>(6 * static_cast<Eigen::Index>(i))) * pose;
  }
  for (const PointTerms& point : points) candidate_points[static_cast<size_t>(point.point)] += point.step;
}

BundleAdjuster::BundleAdjuster() : state_(std::make_unique<State>()) {}
BundleAdjuster::~BundleAdjuster() = default;
BundleAdjuster::BundleAdjuster(BundleAdjuster&&) noexcept = default;
BundleAdjuster& BundleAdjuster::operator=(BundleAdjuster&&) noexcept = default;

BundleSummary BundleAdjuster::solve(const BundleOptions& options, const PinholeCamera& camera, double bf,
                                    BundleProblem& problem, const std::function<bool()>& interrupted) {
  constexpr double kMinDamping = 1e-12, kMaxDamping = 1e12;
  State& state = *state_;
  state.options = options;
  state.camera = camera;
  state.bf = bf;
  state.prepare(problem);

  BundleSummary summary;
  double cost = state.cost(problem.camera_from_world, problem.points_in_world);
  summary.initial_cost = cost;
  double damping = 1e-4, growth = 2;
  bool needs_linearization = true;
  while (summary.iterations < options.max_iterations && damping < kMaxDamping) {
    if (interrupted && interrupted()) {
      summary.interrupted = true;
      break;
    }
    if (needs_linearization) state.linearize(problem);
    ++summary.iterations;
    double new_cost = std::numeric_limits<double>::infinity(), gain = 0;
    if (state.solve_step(damping)) {
      const double predicted = state.predicted_decrease(damping);
      if (predicted <= 1e-3 * options.relative_cost_tolerance * cost) break;
      state.apply_step(problem);
      new_cost = state.cost(state.candidate_poses, state.candidate_points);
      gain = (cost - new_cost) / predicted;
    }
    needs_linearization = new_cost < cost;
    if (needs_linearization) {
      // Nielsen's rule: the better the model predicted, the less damping.
      damping = std::max(kMinDamping, damping * std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)));
      growth = 2;
      std::swap(problem.camera_from_world, state.candidate_poses);
      std::swap(problem.points_in_world, state.candidate_points);
      const bool converged = cost - new_cost <= options.relative_cost_tolerance * cost;
      cost = new_cost;
      if (converged) break;
    } else {
      damping *= growth;
      growth *= 2;
    }
  }
  summary.final_cost = cost;
  return summary;
}

double reprojection_chi2(const PinholeCamera& camera, double bf, const SE3& camera_from_world,
                         const Vec3& point_in_world, const PixelObservation& observation) {
  const Vec3 x = camera_from_world * point_in_world;
  const double chi2 = Reprojection(camera, bf, x, observation).chi2(observation);
  return x.z() > 0 && is_usable(observation) && std::isfinite(chi2) ? chi2 : std::numeric_limits<double>::infinity();
}

void BundleProblem::clear() {
  camera_from_world.clear();
  pose_is_fixed.clear();
  points_in_world.clear();
  observations.clear();
}

void BundleOptions::visit(OptionVisitor& visitor) {
  visitor.value({"max_iterations", "", 1, 1000, "Levenberg-Marquardt steps."}, max_iterations);
  visitor.value({"huber_mono_px", "σ", 0.1, 1e9, "Residual norm above which the loss is linear."}, huber_mono_px);
  visitor.value({"huber_depth_px", "σ", 0.1, 1e9, "The same for observations with depth."}, huber_depth_px);
  visitor.value({"relative_cost_tolerance", "", 0, 1, "Stops when a step improves the cost by a smaller share."},
                relative_cost_tolerance);
}

}  // namespace photoslam
