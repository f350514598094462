// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/relocalization.h"

#include <algorithm>
#include <cmath>

namespace photoslam {
void RelocalizationOptions::visit(OptionVisitor& v) {
  v.value({"max_candidates", "", 1, 1000, "Keyframes tried per frame; more find the place sooner and cost time."},
          max_candidates);
  v.value({"min_matches", "", 6, 1000, "Descriptor matches a candidate needs."}, min_matches);
  v.value({"min_inliers", "", 6, 1000, "Landmarks that must fit the pose found; lower finds more, also wrong ones."},
          min_inliers);
  v.value({"search_radius_px", "px", 1.0, 100.0, "Search radius for further landmarks around the pose found."},
          search_radius_px);
  evidence.visit(v);
  v.group("pose_ransac", "Robust pose from matches.", pose_ransac);
}

void Relocalizer::update(const MapSnapshot& map) {
  for (; num_filed_ < static_cast<int>(map.keyframes.size()); ++num_filed_) {
    places_.add(num_filed_, strongest_descriptors(map.keyframe(KeyframeId(num_filed_)).keyframe.frame->features));
  }
  places_.remove_if([&](int place) { return map.keyframe(KeyframeId(place)).keyframe.culled; });
}

std::optional<Relocalization> Relocalizer::relocalize(const MapSnapshot& map, const FeatureFrame& frame,
                                                      KeyframeId likely) {
  std::vector<KeyframeId> candidates;
  const auto propose = [&](KeyframeId id) {
    if (!map.has(id)) return;
    id = map.living(id);
    if (std::ranges::find(candidates, id) == candidates.end()) candidates.push_back(id);
  };
  propose(likely);
  for (const PlaceCandidate& place : places_.query(strongest_descriptors(frame.features), options_.max_candidates)) {
    propose(KeyframeId(place.place));
  }
  for (const KeyframeId candidate : candidates) {
    if (const auto pose = pose_against(map, frame, candidate)) return Relocalization{*pose, candidate};
  }
  return std::nullopt;
}

std::optional<SE3> Relocalizer::pose_against(const MapSnapshot& map, const FeatureFrame& frame, KeyframeId candidate) {
  const Keyframe& keyframe = map.keyframe(candidate).keyframe;
  MatchOptions match_options;
  match_options.max_distance = 64;
  match_options.max_ratio = 0.8;
  std::vector<int> keypoint_in_frame;
  match_brute_force(match_options, keyframe.frame->features, frame.features, keypoint_in_frame);

  FrameMatches matches(frame.size());
  int count = 0;
  for (size_t i = 0; i < keypoint_in_frame.size(); ++i) {
    LandmarkId id = keyframe.landmarks[i];
    const LandmarkView* view = map.find(id);
    if (keypoint_in_frame[i] == kNoMatch || view == nullptr) continue;
    const auto keypoint = static_cast<size_t>(keypoint_in_frame[i]);
    matches.point[keypoint] = {id, {}, view->position};
    matches.matched[keypoint] = 1;
    ++count;
  }
  if (count < options_.min_matches) return std::nullopt;
  const auto pose = alignment_.estimate(options_.pose_ransac, frame, matches);
  if (!pose) return std::nullopt;
  return verified(map, frame, candidate, *pose);
}

PlaceEvidence Relocalizer::evidence(const FeatureFrame& frame, const FrameMatches& matches) {
  PlaceEvidence evidence(alignment_.camera().width, alignment_.camera().height, frame.features);
  for (const ProjectionQuery& query : alignment_.projector().queries()) evidence.expect(query.x, query.y);
  for (size_t i = 0; i < matches.matched.size(); ++i) {
    const Keypoint& keypoint = frame.features.keypoints[i];
    if (matches.matched[i]) evidence.find(keypoint.x, keypoint.y);
  }
  return evidence;
}

/// Chance agrees with a dozen descriptors; it does not put the landmarks all around where the frame has them.
std::optional<SE3> Relocalizer::verified(const MapSnapshot& map, const FeatureFrame& frame, KeyframeId candidate,
                                         SE3 pose) {
  constexpr size_t kNeighbours = 10;
  std::vector<KeyframeId> keyframes{candidate};
  for (const CovisibleKeyframe& neighbour : map.keyframe(candidate).covisible) {
    if (keyframes.size() > kNeighbours) break;
    keyframes.push_back(neighbour.keyframe);
  }
  MatchOptions match_options;
  match_options.max_distance = 64;
  match_options.max_ratio = 0.85;
  match_options.check_rotation = false;
  int inliers = 0;
  FrameMatches matches;
  for (const double radius : {options_.search_radius_px, options_.search_radius_px / 2}) {
    matches = FrameMatches(frame.size());
    alignment_.project_landmarks(pose, map, keyframes, static_cast<float>(radius), matches);
    alignment_.match(frame, match_options, matches);
    inliers = alignment_.refine(frame, matches, pose);
    if (inliers < options_.min_inliers / 2) return std::nullopt;
  }
  if (inliers < options_.min_inliers || !evidence(frame, matches).suffices(options_.evidence)) return std::nullopt;
  return pose;
}

}  // namespace photoslam
