// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/frame_alignment.h"

#include <cmath>

namespace photoslam {

void FrameAlignment::project_landmarks(const SE3& camera_from_world, const MapSnapshot& map,
                                       const std::vector<KeyframeId>& keyframes, float radius_px,
                                       const FrameMatches& matches) {
  projector_.clear();
  std::vector<bool> seen(static_cast<size_t>(map.num_landmarks));  // a bit each: ids of the dead count, too
  for (size_t i = 0; i < matches.matched.size(); ++i) {
    LandmarkId id = matches.point[i].landmark;
    if (matches.matched[i] && map.find(id) != nullptr) seen[static_cast<size_t>(id.value)] = true;
  }
  for (const KeyframeId keyframe : keyframes) {
    for (LandmarkId id : map.keyframe(keyframe).keyframe.landmarks) {
      const LandmarkView* view = map.find(id);
      if (view == nullptr || seen[static_cast<size_t>(id.value)]) continue;
      seen[static_cast<size_t>(id.value)] = true;
      projector_.add(camera_from_world, id, *view, radius_px);
    }
  }
}

int FrameAlignment::match(const FeatureFrame& frame, const MatchOptions& options, FrameMatches& matches) {
  u_right_.resize(frame.size());
  for (size_t i = 0; i < frame.size(); ++i) u_right_[i] = static_cast<float>(frame.observations[i].u_right);
  matcher_.match(options, {frame.features, frame.grid, u_right_, matches.matched}, projector_.queries(),
                 keypoint_of_query_);
  int count = 0;
  for (size_t query = 0; query < keypoint_of_query_.size(); ++query) {
    if (keypoint_of_query_[query] == kNoMatch) continue;
    const auto keypoint = static_cast<size_t>(keypoint_of_query_[query]);
    matches.point[keypoint] = projector_.point(query);
    matches.matched[keypoint] = 1;
    ++count;
  }
  return count;
}

std::optional<SE3> FrameAlignment::estimate(const PoseRansacOptions& options, const FeatureFrame& frame,
                                            FrameMatches& matches) const {
  std::vector<size_t> keypoints;
  std::vector<Vec3> points;
  std::vector<Vec2> pixels;
  std::vector<double> sigmas;
  for (size_t i = 0; i < frame.size(); ++i) {
    if (!matches.matched[i]) continue;
    keypoints.push_back(i);
    points.push_back(matches.point[i].position);
    pixels.push_back(frame.observations[i].pixel);
    sigmas.push_back(1.0 / std::sqrt(frame.observations[i].inverse_variance));
  }
  const PoseRansacResult result = estimate_pose_ransac(options, camera_, points, pixels, sigmas);
  if (!result.success) return std::nullopt;
  for (size_t i = 0; i < keypoints.size(); ++i) {
    if (!result.inlier[i]) matches.matched[keypoints[i]] = 0;
  }
  return result.camera_from_world;
}

int FrameAlignment::refine(const FeatureFrame& frame, FrameMatches& matches, SE3& camera_from_world) const {
  std::vector<size_t> keypoints;
  std::vector<Vec3> points;
  std::vector<PixelObservation> observations;
  for (size_t i = 0; i < frame.size(); ++i) {
    if (!matches.matched[i]) continue;
    keypoints.push_back(i);
    points.push_back(matches.point[i].position);
    observations.push_back(frame.observations[i]);
  }
  const PoseRefinementResult result = refine_pose(options_, camera_, bf_, points, observations, camera_from_world);
  camera_from_world = result.camera_from_world;
  for (size_t i = 0; i < keypoints.size(); ++i) {
    if (!result.inlier[i]) matches.matched[keypoints[i]] = 0;
  }
  return result.converged ? result.num_inliers : 0;
}

}  // namespace photoslam
