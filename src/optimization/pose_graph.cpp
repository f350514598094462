// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "optimization/pose_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/check.h"
#include "optimization/block_cholesky.h"

namespace photoslam {
namespace {

constexpr int kFixed = -1;

/// One graph under optimisation. Unknowns are the tangents of the free poses, in bandwidth-reducing order.
class Solver {
 public:
  Solver(bool with_scale, double length, PoseGraph& graph) : with_scale_(with_scale), length_(length), graph_(graph) {
    number_unknowns();
    gradient_.resize(7 * static_cast<Eigen::Index>(node_of_unknown_.size()));
    diagonal_.resize(gradient_.size());
  }

  PoseGraphSummary run(const PoseGraphOptions& options);

 private:
  void number_unknowns();
  double cost(const std::vector<Sim3>& poses) const;
  void linearize(double damping);
  bool solve(double damping);

  int unknown(int node) const { return unknown_of_node_[static_cast<size_t>(node)]; }

  bool with_scale_;
  double length_;
  PoseGraph& graph_;
  std::vector<int> unknown_of_node_;  // kFixed where there is none
  std::vector<int> node_of_unknown_;
  std::vector<int> first_column_;
  BlockCholesky<7> system_;
  Eigen::VectorXd gradient_, diagonal_, step_;
  std::vector<Sim3> candidate_;
};

void Solver::number_unknowns() {
  const size_t count = graph_.pose_from_world.size();
  std::vector<std::vector<int>> neighbours(count);
  for (const PoseGraph::Edge& edge : graph_.edges) {
    neighbours[static_cast<size_t>(edge.a)].push_back(edge.b);
    neighbours[static_cast<size_t>(edge.b)].push_back(edge.a);
  }
  unknown_of_node_.assign(count, kFixed);
  for (const int node : bandwidth_reducing_order(neighbours)) {
    if (graph_.pose_is_fixed[static_cast<size_t>(node)]) continue;
    unknown_of_node_[static_cast<size_t>(node)] = static_cast<int>(node_of_unknown_.size());
    node_of_unknown_.push_back(node);
  }
  first_column_.resize(node_of_unknown_.size());
  std::iota(first_column_.begin(), first_column_.end(), 0);
  for (const PoseGraph::Edge& edge : graph_.edges) {
    const auto [low, high] = std::minmax({unknown(edge.a), unknown(edge.b)});
    if (low == kFixed) continue;
    int& first = first_column_[static_cast<size_t>(high)];
    first = std::min(first, low);
  }
}

double Solver::cost(const std::vector<Sim3>& poses) const {
  double sum = 0;
  for (const PoseGraph::Edge& edge : graph_.edges) {
    const Sim3 error =
        edge.b_from_a * poses[static_cast<size_t>(edge.a)] * poses[static_cast<size_t>(edge.b)].inverse();
    Vec7 value = error.log();
    value.head<3>() /= length_;
    sum += 0.5 * edge.weight * value.squaredNorm();
  }
  return sum;
}

/// Normal equations at the present poses, with the diagonal raised by a share of itself.
void Solver::linearize(double damping) {
  system_.reset(first_column_);
  gradient_.setZero();
  for (const PoseGraph::Edge& edge : graph_.edges) {
    const PoseGraphError error(edge.b_from_a, graph_.pose_from_world[static_cast<size_t>(edge.a)],
                               graph_.pose_from_world[static_cast<size_t>(edge.b)], length_);
    const int a = unknown(edge.a), b = unknown(edge.b);
    const auto add = [&](int i, const Mat7& jacobian) {
      if (i == kFixed) return;
      system_.block(i, i) += edge.weight * jacobian.transpose() * jacobian;
      gradient_.segment<7>(7 * i) += edge.weight * jacobian.transpose() * error.value;
    };
    add(a, error.by_a);
    add(b, error.by_b);
    if (a == kFixed || b == kFixed || a == b) continue;
    const Mat7 mixed = edge.weight * error.by_a.transpose() * error.by_b;
    if (a > b) {
      system_.block(a, b) += mixed;
    } else {
      system_.block(b, a) += mixed.transpose();
    }
  }
  for (int i = 0; i < system_.size(); ++i) {
    Mat7& block = system_.block(i, i);
    if (!with_scale_) {  // The scales stay: their equations become 1 * step = 0.
      block.row(6).setZero();
      block.col(6).setZero();
      block(6, 6) = 1;
      gradient_[7 * i + 6] = 0;
      for (int j = first_column_[static_cast<size_t>(i)]; j < i; ++j) {
        system_.block(i, j).row(6).setZero();
        system_.block(i, j).col(6).setZero();
      }
    }
    diagonal_.segment<7>(7 * i) = block.diagonal().cwiseMax(1e-12);
    block.diagonal() += damping * diagonal_.segment<7>(7 * i);
  }
}

bool Solver::solve(double damping) {
  linearize(damping);
  if (!system_.factorize()) return false;
  step_ = -gradient_;
  system_.solve(step_);
  return step_.allFinite();
}

PoseGraphSummary Solver::run(const PoseGraphOptions& options) {
  constexpr double kMinDamping = 1e-12, kMaxDamping = 1e12;
  PoseGraphSummary summary;
  double cost_now = cost(graph_.pose_from_world);
  summary.initial_cost = summary.final_cost = cost_now;
  if (node_of_unknown_.empty()) return summary;
  double damping = 1e-6, growth = 2;
  while (summary.iterations < options.max_iterations && damping < kMaxDamping) {
    ++summary.iterations;
    double new_cost = std::numeric_limits<double>::infinity();
    double predicted = 0;
    if (solve(damping)) {
      predicted = 0.5 * (damping * (diagonal_.array() * step_.array().square()).sum() - gradient_.dot(step_));
      if (predicted <= 1e-3 * options.relative_cost_tolerance * cost_now) break;
      candidate_ = graph_.pose_from_world;
      for (size_t i = 0; i < node_of_unknown_.size(); ++i) {
        Sim3& pose = candidate_[static_cast<size_t>(node_of_unknown_[i])];
        pose = Sim3::exp(step_.segment<7>(7 * static_cast<Eigen::Index>(i))) * pose;
      }
      new_cost = cost(candidate_);
    }
    if (!(new_cost < cost_now)) {
      damping *= growth;
      growth *= 2;
      continue;
    }
    // Nielsen's rule: the better the model predicted, the less damping.
    const double gain = (cost_now - new_cost) / predicted;
    damping = std::max(kMinDamping, damping * std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)));
    growth = 2;
    std::swap(graph_.pose_from_world, candidate_);
    const bool converged = cost_now - new_cost <= options.relative_cost_tolerance * cost_now;
    cost_now = new_cost;
    if (converged) break;
  }
  summary.final_cost = cost_now;
  return summary;
}

}  // namespace

PoseGraphError::PoseGraphError(const Sim3& b_from_a, const Sim3& a_from_world, const Sim3& b_from_world,
                               double length) {
  value = (b_from_a * a_from_world * b_from_world.inverse()).log();
  by_a = sim3_inverse_left_jacobian(value) * b_from_a.adjoint();
  by_b = -sim3_inverse_left_jacobian(-value);
  value.head<3>() /= length;
  by_a.topRows<3>() /= length;
  by_b.topRows<3>() /= length;
}

std::vector<int> bandwidth_reducing_order(const std::vector<std::vector<int>>& neighbours) {
  const auto degree = [&](int node) { return neighbours[static_cast<size_t>(node)].size(); };
  const auto by_degree = [&](int a, int b) { return degree(a) != degree(b) ? degree(a) < degree(b) : a < b; };
  std::vector<int> starts(neighbours.size());
  std::iota(starts.begin(), starts.end(), 0);
  std::ranges::sort(starts, by_degree);
  std::vector<uint8_t> visited(neighbours.size(), 0);
  std::vector<int> order;
  for (const int start : starts) {
    if (visited[static_cast<size_t>(start)]) continue;
    visited[static_cast<size_t>(start)] = 1;
    order.push_back(start);
    for (size_t next = order.size() - 1; next < order.size(); ++next) {
      std::vector<int> ring = neighbours[static_cast<size_t>(order[next])];
      std::ranges::sort(ring, by_degree);
      for (const int node : ring) {
        if (visited[static_cast<size_t>(node)]) continue;
        visited[static_cast<size_t>(node)] = 1;
        order.push_back(node);
      }
    }
  }
  std::ranges::reverse(order);
  return order;
}

void PoseGraphOptions::visit(OptionVisitor& v) {
  v.value({"max_iterations", "", 1, 1000, "Levenberg-Marquardt steps."}, max_iterations);
  v.value({"relative_cost_tolerance", "", 0, 1, "Stops when a step improves the cost by a smaller share."},
          relative_cost_tolerance);
}

PoseGraphSummary optimize_pose_graph(const PoseGraphOptions& options, bool with_scale, double length,
                                     PoseGraph& graph) {
  PHOTOSLAM_CHECK(graph.pose_from_world.size() == graph.pose_is_fixed.size(), "{} poses, {} flags",
                  graph.pose_from_world.size(), graph.pose_is_fixed.size());
  PHOTOSLAM_CHECK(length > 0, "{}", length);
  return Solver(with_scale, length, graph).run(options);
}

}  // namespace photoslam
