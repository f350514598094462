// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/room_trajectory.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "base/check.h"
#include "base/random.h"

namespace photoslam {
namespace {

constexpr int kKnotsPerLap = 10;

struct Waypoint {
  Vec3 position;
  Vec3 target;  ///< What the camera looks at.
};

/// The tour: one waypoint per tenth of a lap. The first lap and the whole tour end where they began.
const std::vector<Waypoint>& tour() {
  static const std::vector<Waypoint> waypoints = {
      // First lap: desk, shelf, rug and sofa, and back over the desk to the sideboard.
      {{3.45, 1.20, 1.50}, {2.30, 3.90, 0.85}},
      {{3.15, 1.02, 1.47}, {1.60, 3.70, 0.85}},
      {{2.80, 0.95, 1.44}, {1.00, 3.20, 0.75}},
      {{2.55, 1.02, 1.41}, {0.60, 2.30, 0.60}},
      {{2.60, 1.30, 1.40}, {0.50, 1.90, 0.60}},
      {{2.85, 1.65, 1.42}, {0.90, 3.00, 0.70}},
      {{3.05, 1.95, 1.44}, {1.50, 3.90, 0.90}},
      {{3.20, 2.10, 1.46}, {2.70, 4.00, 0.95}},
      {{3.41, 1.93, 1.48}, {3.90, 4.00, 0.90}},
      {{3.52, 1.57, 1.50}, {3.30, 4.00, 0.85}},
      // Second lap: sideboard, window, armchair, the pictures on the south wall, stove, cupboard.
      {{3.45, 1.20, 1.50}, {2.30, 3.90, 0.85}},
      {{3.33, 1.55, 1.50}, {3.62, 3.90, 0.85}},
      {{3.13, 2.00, 1.48}, {4.65, 3.60, 0.80}},
      {{2.86, 2.40, 1.46}, {5.00, 2.50, 0.85}},
      {{2.71, 2.70, 1.45}, {4.70, 1.20, 0.75}},
      {{2.68, 2.88, 1.45}, {3.60, 0.30, 0.85}},
      {{2.75, 2.92, 1.46}, {2.70, 0.30, 0.95}},
      {{2.86, 2.84, 1.47}, {1.90, 0.30, 0.95}},
      {{3.00, 2.68, 1.48}, {1.10, 0.60, 0.90}},
      {{3.12, 2.44, 1.48}, {0.50, 1.20, 0.75}},
      // Third lap: sofa, round the coffee table, shelf.
      {{3.15, 2.15, 1.47}, {0.60, 1.90, 0.60}},
      {{3.08, 1.85, 1.44}, {1.20, 1.80, 0.50}},
      {{2.95, 1.48, 1.40}, {1.60, 1.75, 0.45}},
      {{2.70, 1.08, 1.38}, {1.70, 1.90, 0.45}},
      {{2.36, 0.88, 1.38}, {1.85, 2.30, 0.50}},
      {{2.15, 0.95, 1.40}, {1.60, 3.40, 0.75}},
      {{2.32, 1.08, 1.43}, {0.90, 3.80, 0.95}},
      {{2.65, 1.06, 1.46}, {1.30, 3.90, 1.05}},
      {{3.00, 1.04, 1.48}, {2.20, 4.00, 1.00}},
      {{3.28, 1.08, 1.49}, {2.55, 4.00, 0.95}},
  };
  return waypoints;
}

/// Coefficients of the closed uniform cubic B-spline through the points. [N] → [N]
std::vector<Vec3> interpolating_spline(const std::vector<Vec3>& points) {
  const Eigen::Index n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd values(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    basis(i, (i + n - 1) % n) += 1.0 / 6;
    basis(i, i) += 4.0 / 6;
    basis(i, (i + 1) % n) += 1.0 / 6;
    values.row(i) = points[static_cast<size_t>(i)].transpose();
  }
  const Eigen::MatrixXd coefficients = basis.partialPivLu().solve(values);
  std::vector<Vec3> result;
  for (Eigen::Index i = 0; i < n; ++i) result.push_back(coefficients.row(i).transpose());
  return result;
}

Vec3 evaluate(const std::vector<Vec3>& coefficients, double knots) {
  const double whole = std::floor(knots), t = knots - whole;
  const size_t n = coefficients.size(), i = static_cast<size_t>(whole) % n;
  const double u = 1 - t;
  return (u * u * u * coefficients[(i + n - 1) % n] + (3 * t * t * t - 6 * t * t + 4) * coefficients[i] +
          (3 * u * u * u - 6 * u * u + 4) * coefficients[(i + 1) % n] + t * t * t * coefficients[(i + 2) % n]) /
         6;
}

/// Camera axes (x right, y down, z forward) of a camera that looks along `forward` and is held level.
Mat3 level_camera(const Vec3& forward) {
  Mat3 axes;
  axes.col(2) = forward.normalized();
  axes.col(0) = axes.col(2).cross(Vec3::UnitZ()).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

}  // namespace

RoomTrajectory::RoomTrajectory(uint64_t seed, double seconds_per_lap) : laps_per_second_(1 / seconds_per_lap) {
  PHOTOSLAM_CHECK(seconds_per_lap > 0, "{} s", seconds_per_lap);
  Random random(seed * 7919 + 13);
  for (int i = 0; i < 24; ++i) shake_phases_.push_back(random.uniform(0, 2 * std::numbers::pi));
  std::vector<Vec3> positions, targets;
  for (const Waypoint& waypoint : tour()) {
    positions.push_back(waypoint.position);
    targets.push_back(waypoint.target);
  }
  positions_ = interpolating_spline(positions);
  targets_ = interpolating_spline(targets);
}

SE3 RoomTrajectory::world_from_camera(double seconds) const {
  PHOTOSLAM_CHECK(seconds >= 0, "{} s", seconds);
  const double knots = seconds * laps_per_second_ * kKnotsPerLap;
  const Vec3 position = evaluate(positions_, knots), target = evaluate(targets_, knots);
  // A hand trembles slowly and a little: four sines per axis, of frequencies that never meet again.
  const auto shake = [&](size_t axis) {
    static constexpr double kHertz[] = {0.43, 0.81, 1.37, 2.13}, kAmplitude[] = {1.0, 0.6, 0.25, 0.1};
    double sum = 0;
    for (size_t k = 0; k < 4; ++k) {
      sum += kAmplitude[k] * std::sin(2 * std::numbers::pi * kHertz[k] * seconds + shake_phases_[4 * axis + k]);
    }
    return sum;
  };
  const Vec3 turn(0.006 * shake(0), 0.006 * shake(1), 0.010 * shake(2));    // [rad]
  const Vec3 sway(0.0025 * shake(3), 0.0025 * shake(4), 0.005 * shake(5));  // [m]
  return {Quat(level_camera(target - position)) * so3_exp(turn), position + sway};
}

}  // namespace photoslam
