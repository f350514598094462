// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "loop_closure/full_adjustment.h"

#include <algorithm>
#include <set>
#include <vector>

#include "math/median.h"

namespace photoslam {
namespace {

/// All of a map as one least-squares problem.
struct Problem {
  BundleProblem bundle;
  std::vector<LandmarkId> landmark_of_point;
  std::vector<KeyframeId> reference_of_point;  // the oldest observer

  explicit Problem(const MapSnapshot& map, bool scale_is_known);
};

Problem::Problem(const MapSnapshot& map, bool scale_is_known) {
  constexpr int kNone = -1;
  std::vector<int> point_of_landmark(static_cast<size_t>(map.num_landmarks), kNone);
  std::set<KeyframeId> roots_of_known_scale;
  for (const auto& view : map.keyframes) {
    const Keyframe& keyframe = view->keyframe;
    bundle.camera_from_world.push_back(keyframe.camera_from_world);
    const bool is_root = !keyframe.parent.valid();
    const bool is_child_of_root =
        !is_root && !keyframe.culled && !map.keyframe(keyframe.parent).keyframe.parent.valid();
    const bool holds_scale = !scale_is_known && is_child_of_root && roots_of_known_scale.insert(keyframe.parent).second;
    bundle.pose_is_fixed.push_back(is_root || holds_scale || keyframe.culled ? 1 : 0);
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      LandmarkId id = keyframe.landmarks[i];
      const LandmarkView* landmark = map.find(id);
      if (landmark == nullptr) continue;
      int& point = point_of_landmark[static_cast<size_t>(id.value)];
      if (point == kNone) {
        point = static_cast<int>(bundle.points_in_world.size());
        bundle.points_in_world.push_back(landmark->position);
        landmark_of_point.push_back(id);
        reference_of_point.push_back(keyframe.id);
      }
      bundle.observations.push_back({keyframe.id.value, point, keyframe.frame->observations[i]});
    }
  }
}

/// How much deeper the landmarks of each keyframe lie than before, by the median over them.
std::vector<double> depth_ratios(const BundleProblem& before, const BundleProblem& after) {
  std::vector<std::vector<double>> ratios(before.camera_from_world.size());
  for (const auto& o : before.observations) {
    const auto pose = static_cast<size_t>(o.pose), point = static_cast<size_t>(o.point);
    const double was = (before.camera_from_world[pose] * before.points_in_world[point]).z();
    const double is = (after.camera_from_world[pose] * after.points_in_world[point]).z();
    if (was > 0 && is > 0) ratios[pose].push_back(is / was);
  }
  std::vector<double> result;
  for (auto& of_pose : ratios) result.push_back(of_pose.empty() ? 1.0 : lower_median(of_pose));
  return result;
}

/// Fusing takes a few landmarks for one another. They pull the harder the farther they are off, and the ends of a loop
/// give way: what does not fit is left out, in rounds, as what is right comes to fit better and better.
class RobustAdjustment {
 public:
  RobustAdjustment(const BundleOptions& options, const PinholeCamera& camera, double bf)
      : options_(options), camera_(camera), bf_(bf) {}

  /// The observations of the problem stay as they are. False: interrupted.
  bool solve(BundleProblem& problem, const std::function<bool()>& interrupted) {
    struct Round {
      int iterations;
      double gate;  // in thresholds of the robust loss
    };
    const std::vector<BundleProblem::Observation> all = problem.observations;
    for (const auto& [iterations, gate] : {Round{5, 4.0}, Round{5, 2.0}, Round{10, 1.0}}) {
      BundleOptions some = options_;
      some.max_iterations = std::min(iterations, options_.max_iterations);
      const bool stopped = adjuster_.solve(some, camera_, bf_, problem, interrupted).interrupted;
      problem.observations = all;
      if (stopped) return false;
      std::erase_if(problem.observations, [&](const auto& o) { return !fits(problem, o, gate); });
    }
    const bool stopped = adjuster_.solve(options_, camera_, bf_, problem, interrupted).interrupted;
    problem.observations = all;
    return !stopped;
  }

  bool fits(const BundleProblem& problem, const BundleProblem::Observation& o, double gate) const {
    const double threshold = gate * (o.pixel.has_depth() ? options_.huber_depth_px : options_.huber_mono_px);
    return reprojection_chi2(camera_, bf_, problem.camera_from_world[static_cast<size_t>(o.pose)],
                             problem.points_in_world[static_cast<size_t>(o.point)], o.pixel) < threshold * threshold;
  }

 private:
  BundleOptions options_;
  PinholeCamera camera_;
  double bf_;
  BundleAdjuster adjuster_;
};

}  // namespace

MapCorrection adjust_everything(const BundleOptions& options, const PinholeCamera& camera, double bf,
                                const MapSnapshot& map, const std::function<bool()>& interrupted) {
  const bool depth_is_measured = bf > 0;
  Problem problem(map, depth_is_measured);
  const BundleProblem before = problem.bundle;
  RobustAdjustment adjustment(options, camera, bf);
  MapCorrection correction;
  const bool is_done = adjustment.solve(problem.bundle, interrupted);
  if (is_done) correction.adjustment_is_due = false;
  for (const auto& o : problem.bundle.observations) {
    if (!is_done || adjustment.fits(problem.bundle, o, 1.0)) continue;  // half way even what holds a loop does not fit
    correction.wrong_observations.emplace_back(problem.landmark_of_point[static_cast<size_t>(o.point)],
                                               KeyframeId(o.pose));
  }
  std::vector<double> scale(before.camera_from_world.size(), 1.0);
  if (!depth_is_measured) scale = depth_ratios(before, problem.bundle);
  for (size_t i = 0; i < before.camera_from_world.size(); ++i) {
    const SE3& after = problem.bundle.camera_from_world[i];
    const Sim3 camera_from_new_world(1 / scale[i], after.rotation, after.translation / scale[i]);
    correction.new_world_from_old_world.push_back(camera_from_new_world.inverse() * Sim3(before.camera_from_world[i]));
  }
  for (size_t i = 0; i < problem.landmark_of_point.size(); ++i) {
    const auto reference = static_cast<size_t>(problem.reference_of_point[i].value);
    const Vec3 moved = correction.new_world_from_old_world[reference] * before.points_in_world[i];
    correction.landmark_shifts[problem.landmark_of_point[i]] = problem.bundle.points_in_world[i] - moved;
  }
  return correction;
}

}  // namespace photoslam
