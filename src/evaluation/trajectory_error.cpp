// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/trajectory_error.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "evaluation/statistics.h"
#include "io/association.h"

namespace photoslam {
namespace {

using Pairs = std::vector<std::pair<size_t, size_t>>;

std::vector<int64_t> times(const Trajectory& trajectory) {
  std::vector<int64_t> result;
  result.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory) result.push_back(pose.timestamp_ns);
  return result;
}

double degrees(const Quat& rotation) { return so3_log(rotation).norm() * 180 / std::numbers::pi; }

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// How far from the wanted time the end of a motion may be: half of the usual frame interval, at least 20 ms.
int64_t end_tolerance(const std::vector<int64_t>& matched_times) {
  std::vector<double> steps;
  for (size_t i = 1; i < matched_times.size(); ++i) {
    steps.push_back(static_cast<double>(matched_times[i] - matched_times[i - 1]));
  }
  constexpr double kLeast = 20e6;
  return static_cast<int64_t>(std::max(kLeast, percentile(std::move(steps), 0.5) / 2));
}

/// Index of the time nearest to `wanted` in an increasing list.
size_t nearest(const std::vector<int64_t>& increasing, int64_t wanted) {
  const auto after = std::ranges::lower_bound(increasing, wanted);
  if (after == increasing.begin()) return 0;
  const auto index = static_cast<size_t>(after - increasing.begin());
  const bool take_before = after == increasing.end() || wanted - *(after - 1) <= *after - wanted;
  return take_before ? index - 1 : index;
}

/// Share of a path's length (root mean squares about the mean) up to which its width leaves the turn about it open.
constexpr double kStraight = 0.01;

/// The alignment turned about the true path, if that is straight, so that the orientations agree best (least squares of
/// the rotation matrices, in closed form): what positions say about this turn is their noise over the path's width.
Sim3 settle_turn(const Sim3& truth_from_estimate, const Trajectory& estimate, const Trajectory& truth,
                 const Pairs& pairs) {
  const auto count = static_cast<double>(pairs.size());
  Vec3 mean = Vec3::Zero();
  for (const auto& [i, j] : pairs) mean += truth[j].world_from_camera.translation / count;
  Mat3 spread = Mat3::Zero(), estimate_over_truth = Mat3::Zero();
  for (const auto& [i, j] : pairs) {
    const Vec3 offset = truth[j].world_from_camera.translation - mean;
    spread += offset * offset.transpose();
    const Quat turned = truth_from_estimate.rotation * estimate[i].world_from_camera.rotation;
    estimate_over_truth += (turned * truth[j].world_from_camera.rotation.conjugate()).toRotationMatrix();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);  // variances ascend
  if (axes.eigenvalues()[1] > kStraight * kStraight * axes.eigenvalues()[2]) return truth_from_estimate;
  const Vec3 path = axes.eigenvectors().col(2);
  const double sine = (hat(path) * estimate_over_truth).trace();
  const double cosine = estimate_over_truth.trace() - path.dot(estimate_over_truth * path);
  const Quat turn = so3_exp(std::atan2(sine, cosine) * path);
  return Sim3(1, turn, mean - turn * mean) * truth_from_estimate;
}

}  // namespace

Pairs associate(const Trajectory& estimate, const Trajectory& truth, int64_t max_difference_ns) {
  return associate_times(times(estimate), times(truth), max_difference_ns);
}

std::optional<AbsoluteError> absolute_error(const Trajectory& estimate, const Trajectory& truth, bool with_scale) {
  const Pairs pairs = associate(estimate, truth);
  constexpr size_t kFewest = 3;
  if (pairs.size() < kFewest) return std::nullopt;
  std::vector<Vec3> source, target;
  for (const auto& [i, j] : pairs) {
    source.push_back(estimate[i].world_from_camera.translation);
    target.push_back(truth[j].world_from_camera.translation);
  }
  AbsoluteError result;
  const Sim3 by_positions = align_umeyama(source, target, with_scale);
  result.truth_from_estimate = settle_turn(by_positions, estimate, truth, pairs);
  result.scale = by_positions.scale;
  result.matched = pairs.size();

  std::vector<double> distances, angles;
  for (size_t k = 0; k < pairs.size(); ++k) {
    distances.push_back((by_positions * source[k] - target[k]).norm());
    const Quat aligned_rotation =
        result.truth_from_estimate.rotation * estimate[pairs[k].first].world_from_camera.rotation;
    angles.push_back(degrees(truth[pairs[k].second].world_from_camera.rotation.conjugate() * aligned_rotation));
  }
  result.rmse_m = root_mean_square(distances);
  result.std_m = describe(distances).standard_deviation;
  result.median_m = percentile(distances, 0.5);
  result.rot_rmse_deg = root_mean_square(angles);
  return result;
}

std::optional<RelativeError> relative_error(const Trajectory& estimate, const Trajectory& truth, double scale,
                                            double seconds) {
  const Pairs pairs = associate(estimate, truth);
  std::vector<int64_t> matched_times;
  for (const auto& [i, j] : pairs) matched_times.push_back(estimate[i].timestamp_ns);
  if (matched_times.size() < 2) return std::nullopt;
  const int64_t tolerance = end_tolerance(matched_times);
  const auto span_ns = static_cast<int64_t>(std::llround(seconds * 1e9));

  std::vector<double> distances, angles;
  for (size_t a = 0; a < pairs.size(); ++a) {
    const int64_t wanted = matched_times[a] + span_ns;
    const size_t b = nearest(matched_times, wanted);
    if (b <= a || std::abs(matched_times[b] - wanted) > tolerance) continue;
    SE3 estimated = estimate[pairs[a].first].world_from_camera.inverse() * estimate[pairs[b].first].world_from_camera;
    const SE3 actual = truth[pairs[a].second].world_from_camera.inverse() * truth[pairs[b].second].world_from_camera;
    estimated.translation *= scale;
    const SE3 difference = actual.inverse() * estimated;
    distances.push_back(difference.translation.norm());
    angles.push_back(degrees(difference.rotation));
  }
  if (distances.empty()) return std::nullopt;
  return RelativeError{root_mean_square(distances), root_mean_square(angles), distances.size()};
}

Trajectory aligned(const Trajectory& estimate, const Sim3& truth_from_estimate) {
  Trajectory result = estimate;
  for (StampedPose& pose : result) {
    SE3& world_from_camera = pose.world_from_camera;
    world_from_camera = SE3(truth_from_estimate.rotation * world_from_camera.rotation,
                            truth_from_estimate * world_from_camera.translation);
  }
  return result;
}

}  // namespace photoslam
