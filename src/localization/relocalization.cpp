// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/relocalization.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "features/matching.h"

namespace photoslam {
namespace {

std::optional<SE3> pose_against_keyframe(const RelocalizationOptions& options, const PinholeCamera& camera,
                                         const MapSnapshot& map, const FeatureFrame& frame, const Keyframe& keyframe) {
  MatchOptions match_options;
  match_options.max_distance = 64;
  match_options.max_ratio = 0.8;
  std::vector<int> keypoint_in_frame;
  match_brute_force(match_options, keyframe.frame->features, frame.features, keypoint_in_frame);

  std::vector<Vec3> points;
  std::vector<Vec2> pixels;
  std::vector<double> sigmas;
  for (size_t i = 0; i < keypoint_in_frame.size(); ++i) {
    LandmarkId id = keyframe.landmarks[i];
    const LandmarkView* view = map.find(id);
    if (keypoint_in_frame[i] == kNoMatch || view == nullptr) continue;
    const PixelObservation& observation = frame.observations[static_cast<size_t>(keypoint_in_frame[i])];
    points.push_back(view->position);
    pixels.push_back(observation.pixel);
    sigmas.push_back(1.0 / std::sqrt(observation.inverse_variance));
  }
  if (static_cast<int>(points.size()) < options.min_matches) return std::nullopt;
  const PoseRansacResult result = estimate_pose_ransac(options.pose_ransac, camera, points, pixels, sigmas);
  if (!result.success) return std::nullopt;
  return result.camera_from_world;
}

}  // namespace

void RelocalizationOptions::visit(OptionVisitor& v) {
  v.value({"max_candidates", "", 1, 1000, "Keyframes tried per lost frame; more find the place sooner and cost time."},
          max_candidates);
  v.value({"min_matches", "", 6, 1000, "Descriptor matches a candidate needs."}, min_matches);
  v.group("pose_ransac", "Robust pose from matches.", pose_ransac);
}

std::optional<SE3> relocalize(const RelocalizationOptions& options, const PinholeCamera& camera, const MapSnapshot& map,
                              const FeatureFrame& frame, int attempt) {
  const int count = static_cast<int>(map.keyframes.size());
  const int tries = std::min(options.max_candidates, count);
  for (int i = 0; i < tries; ++i) {
    const int back = i == 0 ? 0 : (attempt * (tries - 1) + i) % count;
    const KeyframeView& candidate = map.keyframe(KeyframeId(count - 1 - back));
    if (auto pose = pose_against_keyframe(options, camera, map, frame, candidate.keyframe)) return pose;
  }
  return std::nullopt;
}

}  // namespace photoslam
