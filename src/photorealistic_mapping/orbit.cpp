// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/orbit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <numbers>

#include "base/check.h"
#include "photorealistic_mapping/posed_map.h"

namespace photoslam {
namespace {

/// An ellipse in space, and where to look from it.
struct Ellipse {
  Vec3 center, right, ahead;  ///< Half axes [m], across each other.
  Vec3 target, up;
};

double quantile(const GaussianTable& map, size_t axis, double share) {
  std::vector<double> values;
  for (size_t i = 0; i < map.size(); ++i) values.push_back(static_cast<double>(map.row(i)[axis]));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double width(const GaussianTable& map) {
  const auto along = [&](size_t axis) { return quantile(map, axis, 0.9) - quantile(map, axis, 0.1); };
  return std::max(along(0), along(2));
}

Ellipse around_gaussians(const GaussianTable& map) {
  const Vec3 middle(quantile(map, 0, 0.5), quantile(map, 1, 0.5), quantile(map, 2, 0.5));
  const Vec3 up = -Vec3::UnitY();  // the world's y points down
  const double radius = 0.5 * width(map);
  return {middle + 0.3 * radius * up, radius * Vec3::UnitX(), radius * Vec3::UnitZ(), middle, up};
}

/// As wide as the walk was. A circle of radius r has a variance of r² / 2.
Ellipse around_walk(const std::vector<SE3>& walk, const Vec3& target, double least_radius) {
  Vec3 middle = Vec3::Zero(), down = Vec3::Zero();
  for (const SE3& pose : walk) {
    middle += pose.inverse().translation / static_cast<double>(walk.size());
    down += pose.inverse().rotation * Vec3::UnitY();
  }
  const Vec3 up = down.norm() > 1e-6 ? Vec3(-down.normalized()) : Vec3(-Vec3::UnitY());
  const Mat3 level = Mat3::Identity() - up * up.transpose();
  Mat3 variance = -1e-9 * up * up.transpose();  // the smallest of all is that along `up`
  for (const SE3& pose : walk) {
    const Vec3 away = level * (pose.inverse().translation - middle);
    variance += away * away.transpose() / static_cast<double>(walk.size());
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(variance);
  const auto half_axis = [&](int i) -> Vec3 {
    return std::max(std::sqrt(std::max(0.0, 2 * solver.eigenvalues()[i])), least_radius) * solver.eigenvectors().col(i);
  };
  return {middle, half_axis(2), half_axis(1), target, up};
}

std::vector<SE3> views_from(const Ellipse& ellipse, int num_frames) {
  std::vector<SE3> poses;
  for (int i = 0; i < num_frames; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / num_frames;
    const Vec3 position = ellipse.center + std::sin(angle) * ellipse.right - std::cos(angle) * ellipse.ahead;
    const Vec3 forward = (ellipse.target - position).normalized();
    const Vec3 right = forward.cross(ellipse.up).normalized();
    Mat3 world_from_camera;
    world_from_camera << right, forward.cross(right), forward;
    poses.push_back(SE3(Quat(world_from_camera), position).inverse());
  }
  return poses;
}

/// The walk once more, circling around it.
std::vector<SE3> swinging_along(const std::vector<SE3>& walk, double radius, int num_frames) {
  constexpr double kTurns = 6;
  std::vector<SE3> poses;
  for (int i = 0; i < num_frames; ++i) {
    const double share = (i + 0.5) / num_frames, at = share * static_cast<double>(walk.size() - 1);
    const auto before = static_cast<size_t>(at), after = std::min(before + 1, walk.size() - 1);
    const SE3 a = walk[before].inverse(), b = walk[after].inverse();
    const double between = at - static_cast<double>(before), angle = 2 * std::numbers::pi * kTurns * share;
    const SE3 world_from_camera(a.rotation.slerp(between, b.rotation),
                                (1 - between) * a.translation + between * b.translation);
    poses.push_back(
        (world_from_camera * SE3(Quat::Identity(), radius * Vec3(std::sin(angle), std::cos(angle), 0))).inverse());
  }
  return poses;
}

}  // namespace

std::vector<SE3> orbit(const GaussianTable& map, const Trajectory& keyframes, int num_frames) {
  PHOTOSLAM_CHECK(map.size() > 0, "no gaussians");
  if (keyframes.empty()) return views_from(around_gaussians(map), num_frames);
  std::vector<SE3> walk;
  for (const StampedPose& keyframe : keyframes) walk.push_back(keyframe.world_from_camera.inverse());
  const double aside = 0.02 * width(map);
  const Vec3 focus = focus_point(walk);
  double nearest = std::numeric_limits<double>::infinity();
  for (const SE3& pose : walk) nearest = std::min(nearest, (pose * focus).norm());
  const auto is_in_view = [&](const SE3& pose) { return (pose * focus).normalized().z() > std::numbers::sqrt2 / 2; };
  if (std::ranges::all_of(walk, is_in_view)) {
    return views_from(around_walk(walk, focus, std::min(aside, 0.1 * nearest)), num_frames);
  }
  return swinging_along(walk, aside, num_frames);
}

}  // namespace photoslam
