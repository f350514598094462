// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/keyframe_decision.h"

#include <algorithm>
#include <numbers>

namespace photoslam {

void KeyframeDecisionOptions::visit(OptionVisitor& v) {
  v.value({"min_interval_s", "s", 0.0, 10.0, "Shortest time between keyframes."}, min_interval_s);
  v.value({"max_interval_s", "s", 0.05, 1000.0, "Longest time between keyframes while the camera moves."},
          max_interval_s);
  v.value({"min_tracked_ratio", "", 0.0, 1.0,
           "New keyframe when fewer landmarks are tracked, relative to the most since the last one."},
          min_tracked_ratio);
  v.value({"max_rotation_deg", "deg", 1.0, 180.0, "New keyframe when the view turned this far, …"}, max_rotation_deg);
  v.value({"max_translation", "", 0.01, 10.0,
           "… or the camera moved this share of the median depth; of both together the shares add up."},
          max_translation);
}

bool KeyframeDecision::should_insert(int64_t timestamp_ns, const SE3& camera_from_world, int num_tracked,
                                     double median_depth) {
  most_tracked_ = std::max(most_tracked_, num_tracked);
  const double elapsed = 1e-9 * static_cast<double>(timestamp_ns - last_ns_);
  if (elapsed < options_.min_interval_s) return false;

  const SE3 motion = camera_from_world * last_camera_from_world_.inverse();
  const double turned = so3_log(motion.rotation).norm() / (options_.max_rotation_deg * std::numbers::pi / 180.0);
  const double moved = motion.translation.norm() / (options_.max_translation * std::max(median_depth, 1e-6));
  // A camera at rest sees nothing new, however long it stays.
  constexpr double kAtRest = 0.1;
  if (elapsed > options_.max_interval_s && std::max(turned, moved) > kAtRest) return true;
  return turned + moved > 1.0 || num_tracked < options_.min_tracked_ratio * most_tracked_;
}

void KeyframeDecision::inserted(int64_t timestamp_ns, const SE3& camera_from_world) {
  last_ns_ = timestamp_ns;
  last_camera_from_world_ = camera_from_world;
  most_tracked_ = 0;
}

}  // namespace photoslam
