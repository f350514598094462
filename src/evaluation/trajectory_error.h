// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "io/trajectory_file.h"
#include "math/umeyama.h"

namespace photoslam {

/// Pairs of indices (estimate, truth) of the poses that belong together: nearest in time, at most `max_difference_ns`
/// apart, every pose in one pair at most. Both trajectories are sorted by time.
std::vector<std::pair<size_t, size_t>> associate(const Trajectory& estimate, const Trajectory& truth,
                                                 int64_t max_difference_ns = 20'000'000);

/// Absolute trajectory error after the best alignment of estimate to truth by their positions (Umeyama 1991; Sturm et
/// al. 2012). Where the path is straight to a hundredth, positions leave the turn about it open: for rot_rmse_deg and
/// truth_from_estimate, not for the distances, orientations settle it.
struct AbsoluteError {
  double rmse_m = 0;
  double std_m = 0;
  double median_m = 0;
  double rot_rmse_deg = 0;   ///< Angle between the aligned and the true orientation.
  double scale = 1;          ///< Of the alignment; 1 unless asked for.
  size_t matched = 0;        ///< Pairs of poses compared.
  Sim3 truth_from_estimate;  ///< The alignment of the worlds.
};

/// Nothing when fewer than three poses match.
std::optional<AbsoluteError> absolute_error(const Trajectory& estimate, const Trajectory& truth, bool with_scale);

/// Relative pose error: of the motion over a time span, root mean square over all start times.
struct RelativeError {
  double trans_m = 0;
  double rot_deg = 0;
  size_t pairs = 0;
};

/// `scale` multiplies the estimate's translations (AbsoluteError::scale of a monocular run). Nothing when the estimate
/// has no two matched poses that far apart (within half a frame interval or 20 ms).
std::optional<RelativeError> relative_error(const Trajectory& estimate, const Trajectory& truth, double scale = 1,
                                            double seconds = 1);

/// The estimate in the world of the truth.
Trajectory aligned(const Trajectory& estimate, const Sim3& truth_from_estimate);

}  // namespace photoslam
