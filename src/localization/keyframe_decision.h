// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/options.h"
#include "math/se3.h"

namespace photoslam {

struct KeyframeDecisionOptions {
  double min_interval_s = 0.1;
  double max_interval_s = 1.0;     ///< A keyframe at least this often while the camera moves.
  double min_tracked_ratio = 0.7;  ///< Tracked landmarks, relative to the most since the last keyframe.
  double max_rotation_deg = 7.0;   ///< A keyframe when the shares of this and of max_translation add up to one.
  double max_translation = 0.10;   ///< Relative to the median depth of the tracked landmarks.
  void visit(OptionVisitor& visitor);
};

/// Decides which tracked frames become keyframes: those that see new ground, soon enough for the next frames to track.
class KeyframeDecision {
 public:
  explicit KeyframeDecision(const KeyframeDecisionOptions& options) : options_(options) {}

  /// `num_tracked` landmarks were matched in this frame, at a median depth [m].
  bool should_insert(int64_t timestamp_ns, const SE3& camera_from_world, int num_tracked, double median_depth);

  /// Tells that the frame became a keyframe.
  void inserted(int64_t timestamp_ns, const SE3& camera_from_world);

 private:
  KeyframeDecisionOptions options_;
  int64_t last_ns_ = 0;
  SE3 last_camera_from_world_;
  int most_tracked_ = 0;
};

}  // namespace photoslam
