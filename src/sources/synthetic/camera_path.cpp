// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/camera_path.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/check.h"
#include "base/random.h"

namespace photoslam {
namespace {

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

Walk::Walk(uint64_t seed, const std::vector<Waypoint>& waypoints, double laps_per_second, int knots_per_lap)
    : laps_per_second_(laps_per_second), knots_per_lap_(knots_per_lap) {
  PHOTOSLAM_CHECK(laps_per_second > 0 && waypoints.size() >= 4, "{} Hz, {} waypoints", laps_per_second,
                  waypoints.size());
  Random random(seed * 7919 + 13);
  for (int i = 0; i < 24; ++i) shake_phases_.push_back(random.uniform(0, 2 * std::numbers::pi));
  std::vector<Vec3> positions, targets;
  for (const Waypoint& waypoint : waypoints) {
    positions.push_back(waypoint.position);
    targets.push_back(waypoint.target);
  }
  positions_ = interpolating_spline(positions);
  targets_ = interpolating_spline(targets);
}

SE3 Walk::world_from_camera(double seconds) const {
  PHOTOSLAM_CHECK(seconds >= 0, "{} s", seconds);
  const double knots = seconds * laps_per_second_ * knots_per_lap_;
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

RecordedPath::RecordedPath(Trajectory poses) : poses_(std::move(poses)) { PHOTOSLAM_CHECK(!poses_.empty()); }

double RecordedPath::seconds() const {
  return static_cast<double>(poses_.back().timestamp_ns - poses_.front().timestamp_ns) * 1e-9;
}

SE3 RecordedPath::world_from_camera(double seconds) const {
  const auto time = poses_.front().timestamp_ns + static_cast<int64_t>(std::llround(seconds * 1e9));
  const auto after = std::ranges::upper_bound(poses_, time, {}, &StampedPose::timestamp_ns);
  if (after == poses_.end()) return poses_.back().world_from_camera;
  if (after == poses_.begin()) return poses_.front().world_from_camera;
  const StampedPose &a = *std::prev(after), &b = *after;
  const double t = static_cast<double>(time - a.timestamp_ns) / static_cast<double>(b.timestamp_ns - a.timestamp_ns);
  return {a.world_from_camera.rotation.slerp(t, b.world_from_camera.rotation),
          (1 - t) * a.world_from_camera.translation + t * b.world_from_camera.translation};
}

Result<Trajectory> read_walk(const std::filesystem::path& tum_file) {
  Result<Trajectory> poses = read_tum_trajectory(tum_file);
  if (poses && poses->empty()) return error("{}: has no poses; a walk needs at least one", tum_file.string());
  return poses;
}

std::vector<Waypoint> walk_along(const std::vector<Vec2>& corners, double radius, double spacing, double ahead,
                                 double eye_height) {
  // A dense polyline with arcs for corners, then points at equal lengths along it.
  std::vector<Vec2> line;
  const size_t n = corners.size();
  for (size_t i = 0; i < n; ++i) {
    const Vec2 &before = corners[(i + n - 1) % n], &here = corners[i], &after = corners[(i + 1) % n];
    const Vec2 in = (here - before).normalized(), out = (after - here).normalized();
    constexpr int kPieces = 16;
    const Vec2 from = here - radius * in, to = here + radius * out;
    for (int k = 0; k <= kPieces; ++k) {  // a parabola that touches both sides
      const double t = static_cast<double>(k) / kPieces;
      line.emplace_back((1 - t) * (1 - t) * from + 2 * t * (1 - t) * here + t * t * to);
    }
  }
  std::vector<double> lengths = {0};
  for (size_t i = 0; i < line.size(); ++i) {
    lengths.push_back(lengths.back() + (line[(i + 1) % line.size()] - line[i]).norm());
  }
  const auto at = [&](double length) -> Vec2 {
    length = std::fmod(length, lengths.back());
    const auto i = static_cast<size_t>(std::ranges::upper_bound(lengths, length) - lengths.begin()) - 1;
    const double t = (length - lengths[i]) / std::max(lengths[i + 1] - lengths[i], 1e-12);
    return (1 - t) * line[i] + t * line[(i + 1) % line.size()];
  };
  const int count = std::max(4, static_cast<int>(std::lround(lengths.back() / spacing)));
  std::vector<Waypoint> waypoints;
  for (int i = 0; i < count; ++i) {
    const double length = i * lengths.back() / count;
    const Vec2 position = at(length), target = at(length + ahead);
    waypoints.push_back({{position.x(), position.y(), eye_height}, {target.x(), target.y(), eye_height - 0.1}});
  }
  return waypoints;
}

}  // namespace photoslam
