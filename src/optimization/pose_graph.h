// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/options.h"
#include "math/sim3.h"

namespace photoslam {

/// Poses and what is known about pairs of them. Plain arrays; edges refer to poses by index.
struct PoseGraph {
  struct Edge {
    int a = 0, b = 0;
    Sim3 b_from_a;        ///< As measured.
    double weight = 1.0;  ///< Factor of the squared error.
  };
  std::vector<Sim3> pose_from_world;   ///< [P], changed in place unless fixed.
  std::vector<uint8_t> pose_is_fixed;  ///< [P] At least one per connected part.
  std::vector<Edge> edges;
};

struct PoseGraphOptions {
  int max_iterations = 30;
  double relative_cost_tolerance = 1e-6;
  void visit(OptionVisitor& visitor);
};

struct PoseGraphSummary {
  int iterations = 0;
  double initial_cost = 0;  ///< ½ Σ weight |error|²
  double final_cost = 0;
};

/// The error of an edge, log(b_from_a a_from_world world_from_b), with translations in units of `length`, and its
/// derivatives by left tangents of both poses.
struct PoseGraphError {
  Vec7 value;
  Mat7 by_a, by_b;
  PoseGraphError(const Sim3& b_from_a, const Sim3& a_from_world, const Sim3& b_from_world, double length);
};

/// Spreads the contradictions of a pose graph evenly over its edges: Levenberg-Marquardt on a skyline factorisation in
/// Cuthill-McKee order. Without scale all poses and measurements must have scale 1 and keep it. `length` is the
/// translational error that weighs as much as a radian. Deterministic.
PoseGraphSummary optimize_pose_graph(const PoseGraphOptions& options, bool with_scale, double length, PoseGraph& graph);

/// An order of the nodes 0 … n−1 that keeps neighbours close (reverse Cuthill-McKee): result[position] = node.
std::vector<int> bandwidth_reducing_order(const std::vector<std::vector<int>>& neighbours);

}  // namespace photoslam
