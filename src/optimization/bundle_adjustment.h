// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "optimization/pose_refinement.h"

namespace photoslam {

/// Keyframe poses and points to refine together. Plain arrays; observations refer to them by index.
struct BundleProblem {
  struct Observation {
    int pose = 0;
    int point = 0;
    PixelObservation pixel;
  };
  std::vector<SE3> camera_from_world;  ///< [P], changed in place unless fixed.
  std::vector<uint8_t> pose_is_fixed;  ///< [P]
  std::vector<Vec3> points_in_world;   ///< [M], changed in place.
  std::vector<Observation> observations;

  void clear();
};

struct BundleOptions {
  int max_iterations = 10;
  double huber_mono_px = 2.4477;   ///< sqrt(5.991): residual norm in σ above which the loss is linear.
  double huber_depth_px = 2.7955;  ///< sqrt(7.815)
  double relative_cost_tolerance = 1e-4;
  void visit(OptionVisitor& visitor);
};

struct BundleSummary {
  int iterations = 0;
  double initial_cost = 0;  ///< ½ Σ ρ
  double final_cost = 0;
  bool interrupted = false;
};

/// Bundle adjustment, Eq. (2) of Photo-SLAM: Levenberg-Marquardt on the Schur complement of the points. One thread,
/// deterministic, no allocation when one solver is reused on problems of similar size.
class BundleAdjuster {
 public:
  BundleAdjuster();
  ~BundleAdjuster();
  BundleAdjuster(BundleAdjuster&&) noexcept;
  BundleAdjuster& operator=(BundleAdjuster&&) noexcept;

  /// Stops early, with the best state so far, once `interrupted()` returns true (asked between iterations).
  BundleSummary solve(const BundleOptions& options, const PinholeCamera& camera, double bf, BundleProblem& problem,
                      const std::function<bool()>& interrupted = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Squared normalised reprojection error (χ²) of one observation; infinite for a point behind the camera.
double reprojection_chi2(const PinholeCamera& camera, double bf, const SE3& camera_from_world,
                         const Vec3& point_in_world, const PixelObservation& observation);

}  // namespace photoslam
