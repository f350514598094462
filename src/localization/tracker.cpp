// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/tracker.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/check.h"
#include "math/median.h"

namespace photoslam {
namespace {

/// How far apart two views are: 1 at half the median depth of translation, or at 45° between the viewing directions.
double view_distance(const SE3& a_from_world, const SE3& b_from_world, double median_depth) {
  const SE3 a_from_b = a_from_world * b_from_world.inverse();
  const double cosine = (a_from_b.rotation * Vec3::UnitZ()).z();
  constexpr double kQuarterTurn = 1.0 - 0.7071;
  return a_from_b.translation.norm() / (0.5 * std::max(median_depth, 1e-6)) + (1.0 - cosine) / kQuarterTurn;
}

}  // namespace

const char* to_string(TrackingState state) {
  switch (state) {
    case TrackingState::initializing:
      return "initializing";
    case TrackingState::tracking:
      return "tracking";
    case TrackingState::recently_lost:
      return "recently lost";
    case TrackingState::lost:
      return "lost";
  }
  return "unknown";
}

void TrackerOptions::visit(OptionVisitor& v) {
  v.value({"min_initial_landmarks", "", 10, 10000, "Keypoints with depth that the first keyframe needs."},
          min_initial_landmarks);
  v.value({"min_inliers", "", 6, 1000, "Tracking fails with fewer matched landmarks."}, min_inliers);
  v.value({"last_frame_radius_px", "px", 1.0, 200.0,
           "Search radius around the position predicted from the last frame; widened three times when too few match."},
          last_frame_radius_px);
  v.value({"local_map_radius_px", "px", 1.0, 100.0, "Search radius around the projection of a local landmark."},
          local_map_radius_px);
  v.value({"max_local_keyframes", "", 1, 1000, "Keyframes whose landmarks are searched in each frame."},
          max_local_keyframes);
  v.value({"recently_lost_s", "s", 0.0, 1000.0, "After this long without a pose the state is lost."}, recently_lost_s);
  v.group("pose_refinement", "Motion-only bundle adjustment, Eq. (1).", pose_refinement);
  v.group("keyframes", "When a frame becomes a keyframe.", keyframes);
  v.group("relocalization", "Finding the map again after tracking was lost.", relocalization);
}

Tracker::Tracker(const TrackerOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf)
    : options_(options), camera_(camera), bf_(bf), projector_(orb, camera, bf), keyframe_decision_(options.keyframes) {}

TrackingResult Tracker::track(std::shared_ptr<const FeatureFrame> frame, std::shared_ptr<const MapSnapshot> map,
                              bool may_become_keyframe) {
  map_ = std::move(map);
  std::erase_if(pending_, [&](const auto& entry) { return map_ && map_->has(entry.first); });
  if (num_proposed_ == 0) {
    if (!may_become_keyframe) return lost(*frame, "waiting for the first keyframe");
    return initialize(frame);
  }

  SE3 camera_from_world;
  Matches matches(frame->size());
  bool found = lost_frames_ == 0 && track_last_frame(*frame, camera_from_world);
  if (!found && map_) {
    const auto pose = relocalize(options_.relocalization, camera_, *map_, *frame, lost_frames_);
    found = pose.has_value();
    if (found) camera_from_world = *pose;
    has_motion_ = false;
  }
  if (!found) return lost(*frame, frame->size() < 50 ? "too little texture" : "too few matches");

  const int num_inliers = track_local_map(*frame, camera_from_world, matches);
  if (num_inliers < options_.min_inliers) return lost(*frame, "too few landmarks of the local map");
  return tracked(frame, camera_from_world, matches, num_inliers, may_become_keyframe);
}

TrackingResult Tracker::initialize(const std::shared_ptr<const FeatureFrame>& frame) {
  const auto with_depth = std::ranges::count_if(frame->depth, [](float d) { return d > 0; });
  if (with_depth < options_.min_initial_landmarks) {
    return lost(*frame, fmt::format("{} keypoints with depth, {} needed", with_depth, options_.min_initial_landmarks));
  }
  TrackingResult result;
  result.camera_from_world = SE3{};
  Matches matches(frame->size());
  result.keyframe = propose(frame, result, matches);
  result.state = TrackingState::tracking;
  result.has_pose = true;
  result.reference = reference_;
  result.num_features = static_cast<int>(frame->size());
  result.num_inliers = static_cast<int>(with_depth);
  last_ = frame;
  last_landmarks_ = std::move(matches.landmark);
  return result;
}

TrackingResult Tracker::lost(const FeatureFrame& frame, std::string reason) {
  TrackingResult result;
  result.reason = std::move(reason);
  result.num_features = static_cast<int>(frame.size());
  if (num_proposed_ == 0) return result;
  ++lost_frames_;
  has_motion_ = false;
  const double gap_s = 1e-9 * static_cast<double>(frame.timestamp_ns - last_->timestamp_ns);
  result.state = gap_s <= options_.recently_lost_s ? TrackingState::recently_lost : TrackingState::lost;
  return result;
}

TrackingResult Tracker::tracked(const std::shared_ptr<const FeatureFrame>& frame, const SE3& camera_from_world,
                                const Matches& matches, int num_inliers, bool may_become_keyframe) {
  const SE3 last_camera_from_world = last_camera_from_reference_ * pose_of(reference_);
  has_motion_ = lost_frames_ == 0;
  motion_ = camera_from_world * last_camera_from_world.inverse();
  lost_frames_ = 0;

  TrackingResult result;
  result.state = TrackingState::tracking;
  result.has_pose = true;
  result.camera_from_world = camera_from_world;
  result.reference = reference_;
  result.camera_from_reference = camera_from_world * pose_of(reference_).inverse();
  result.num_features = static_cast<int>(frame->size());
  result.num_inliers = num_inliers;
  if (may_become_keyframe && keyframe_decision_.should_insert(frame->timestamp_ns, camera_from_world, num_inliers,
                                                              median_depth(camera_from_world, matches))) {
    result.keyframe = propose(frame, result, matches);
    result.reference = reference_;
    result.camera_from_reference = SE3{};
  }
  last_ = frame;
  last_landmarks_ = matches.landmark;
  last_camera_from_reference_ = result.camera_from_reference;
  return result;
}

SE3 Tracker::pose_of(KeyframeId keyframe) const {
  if (map_ && map_->has(keyframe)) return map_->keyframe(keyframe).keyframe.camera_from_world;
  const PendingKeyframe& pending = pending_.at(keyframe);
  if (!pending.reference.valid()) return pending.camera_from_reference;
  return pending.camera_from_reference * pose_of(pending.reference);
}

SE3 Tracker::predict_pose() const {
  const SE3 last_camera_from_world = last_camera_from_reference_ * pose_of(reference_);
  return has_motion_ ? motion_ * last_camera_from_world : last_camera_from_world;
}

int Tracker::match(const FeatureFrame& frame, const MatchOptions& options, Matches& matches) {
  std::vector<float> u_right(frame.size());
  for (size_t i = 0; i < frame.size(); ++i) u_right[i] = static_cast<float>(frame.observations[i].u_right);
  std::vector<int> keypoint_of_query;
  matcher_.match(options, {frame.features, frame.grid, u_right, matches.matched}, projector_.queries(),
                 keypoint_of_query);
  int count = 0;
  for (size_t query = 0; query < keypoint_of_query.size(); ++query) {
    if (keypoint_of_query[query] == kNoMatch) continue;
    const auto keypoint = static_cast<size_t>(keypoint_of_query[query]);
    matches.landmark[keypoint] = projector_.landmark(query).id;
    matches.position[keypoint] = projector_.landmark(query).position;
    matches.matched[keypoint] = 1;
    ++count;
  }
  return count;
}

bool Tracker::track_last_frame(const FeatureFrame& frame, SE3& camera_from_world) {
  camera_from_world = predict_pose();
  const SE3 world_from_last = (last_camera_from_reference_ * pose_of(reference_)).inverse();
  MatchOptions match_options;
  for (const double widening : {1.0, 3.0}) {
    projector_.clear();
    const auto radius = static_cast<float>(options_.last_frame_radius_px * widening);
    for (size_t i = 0; i < last_->size(); ++i) {
      LandmarkId id = last_landmarks_[i];
      const Keypoint& keypoint = last_->features.keypoints[i];
      const Descriptor& descriptor = last_->features.descriptors[i];
      if (const LandmarkView* view = map_ ? map_->find(id) : nullptr) {
        projector_.add(camera_from_world, id, view->position, keypoint, descriptor, radius);
      } else if (last_->depth[i] > 0) {
        const Vec3 point =
            world_from_last * camera_.unproject(last_->observations[i].pixel, static_cast<double>(last_->depth[i]));
        projector_.add(camera_from_world, LandmarkId{}, point, keypoint, descriptor, radius);
      }
    }
    Matches matches(frame.size());
    SE3 refined = camera_from_world;
    if (match(frame, match_options, matches) >= options_.min_inliers &&
        refine(frame, matches, refined) >= options_.min_inliers / 2) {
      camera_from_world = refined;
      return true;
    }
  }
  return false;
}

int Tracker::track_local_map(const FeatureFrame& frame, SE3& camera_from_world, Matches& matches) {
  project_local_landmarks(camera_from_world);
  MatchOptions match_options;
  match_options.max_ratio = 0.85;
  match_options.check_rotation = false;
  match(frame, match_options, matches);

  // Until the map knows the first keyframes, the last frame's own depth carries the tracking.
  if (!map_ || map_->num_landmarks == 0) {
    projector_.clear();
    const SE3 world_from_last = (last_camera_from_reference_ * pose_of(reference_)).inverse();
    for (size_t i = 0; i < last_->size(); ++i) {
      if (!(last_->depth[i] > 0)) continue;
      const Vec3 point =
          world_from_last * camera_.unproject(last_->observations[i].pixel, static_cast<double>(last_->depth[i]));
      projector_.add(camera_from_world, LandmarkId{}, point, last_->features.keypoints[i],
                     last_->features.descriptors[i], static_cast<float>(options_.local_map_radius_px));
    }
    match(frame, match_options, matches);
  }

  for (size_t i = 0; i < projector_.size(); ++i) {
    if (projector_.landmark(i).id.valid()) ++sightings_[projector_.landmark(i).id].visible;
  }
  const int num_inliers = refine(frame, matches, camera_from_world);
  for (const LandmarkId id : matches.landmark) {
    if (id.valid()) ++sightings_[id].found;
  }
  return num_inliers;
}

int Tracker::refine(const FeatureFrame& frame, Matches& matches, SE3& camera_from_world) const {
  std::vector<size_t> keypoints;
  std::vector<Vec3> points;
  std::vector<PixelObservation> observations;
  for (size_t i = 0; i < frame.size(); ++i) {
    if (!matches.matched[i]) continue;
    keypoints.push_back(i);
    points.push_back(matches.position[i]);
    observations.push_back(frame.observations[i]);
  }
  const PoseRefinementResult result =
      refine_pose(options_.pose_refinement, camera_, bf_, points, observations, camera_from_world);
  camera_from_world = result.camera_from_world;
  for (size_t i = 0; i < keypoints.size(); ++i) {
    if (result.inlier[i]) continue;
    matches.landmark[keypoints[i]] = LandmarkId{};
    matches.matched[keypoints[i]] = 0;
  }
  return result.converged ? result.num_inliers : 0;
}

std::vector<KeyframeId> Tracker::local_keyframes(const SE3& camera_from_world) const {
  constexpr double kOverlap = 2.0;  // views farther apart than this (see view_distance) hardly share landmarks
  std::vector<std::pair<double, KeyframeId>> candidates;
  for (const auto& view : map_->keyframes) {
    const double distance = view_distance(camera_from_world, view->keyframe.camera_from_world, view->median_depth);
    if (distance < kOverlap) candidates.emplace_back(distance, view->keyframe.id);
  }
  std::ranges::sort(candidates);
  std::vector<KeyframeId> ids;
  for (const auto& [distance, id] : candidates) {
    if (static_cast<int>(ids.size()) >= options_.max_local_keyframes) break;
    ids.push_back(id);
  }
  // Fast motion can leave every keyframe behind: then what the newest one sees must do.
  if (ids.empty() && !map_->keyframes.empty()) ids.push_back(map_->keyframes.back()->keyframe.id);
  return ids;
}

void Tracker::project_local_landmarks(const SE3& camera_from_world) {
  projector_.clear();
  if (!map_) return;
  std::set<LandmarkId> seen;
  for (const KeyframeId id : local_keyframes(camera_from_world)) {
    for (LandmarkId landmark : map_->keyframe(id).keyframe.landmarks) {
      const LandmarkView* view = map_->find(landmark);
      if (view == nullptr || !seen.insert(landmark).second) continue;
      projector_.add(camera_from_world, landmark, *view, static_cast<float>(options_.local_map_radius_px));
    }
  }
}

double Tracker::median_depth(const SE3& camera_from_world, const Matches& matches) const {
  std::vector<double> depths;
  for (size_t i = 0; i < matches.position.size(); ++i) {
    if (matches.matched[i]) depths.push_back((camera_from_world * matches.position[i]).z());
  }
  return depths.empty() ? 0 : lower_median(depths);
}

KeyframeProposal Tracker::propose(const std::shared_ptr<const FeatureFrame>& frame, const TrackingResult& result,
                                  const Matches& matches) {
  KeyframeProposal proposal;
  proposal.id = KeyframeId(num_proposed_++);
  proposal.frame = frame;
  proposal.reference = reference_;
  proposal.camera_from_reference = reference_.valid() ? result.camera_from_reference : result.camera_from_world;
  proposal.landmarks = matches.landmark;
  proposal.sightings = std::move(sightings_);
  sightings_.clear();
  pending_[proposal.id] = {proposal.reference, proposal.camera_from_reference};
  reference_ = proposal.id;
  keyframe_decision_.inserted(frame->timestamp_ns, result.camera_from_world);
  return proposal;
}

}  // namespace photoslam
