// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/tracker.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/check.h"
#include "map/map_spacing.h"
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

/// Of the matched points [m]; 0 when there are none.
double median_depth(const SE3& camera_from_world, const FrameMatches& matches) {
  std::vector<double> depths;
  for (size_t i = 0; i < matches.matched.size(); ++i) {
    if (matches.matched[i]) depths.push_back((camera_from_world * matches.point[i].position).z());
  }
  return depths.empty() ? 0 : lower_median(depths);
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
  v.value({"min_found_share", "", 0.0, 1.0,
           "A pose where less than this share of the points that should be visible is found is none: the camera is "
           "looked for in the whole map."},
          min_found_share);
  v.value({"recently_lost_s", "s", 0.0, 1000.0,
           "After this long without a pose the state is lost, and a separate map may begin."},
          recently_lost_s);
  v.group("initialization", "The first two views of a single camera.", initialization);
  v.group("pose_refinement", "Motion-only bundle adjustment, Eq. (1).", pose_refinement);
  v.group("keyframes", "When a frame becomes a keyframe.", keyframes);
  v.group("relocalization", "Finding the camera in the whole map, when tracking was lost or is doubted.",
          relocalization);
}

Tracker::Tracker(const TrackerOptions& options, const OrbOptions& orb, const PinholeCamera& camera, double bf)
    : options_(options),
      camera_(camera),
      bf_(bf),
      alignment_(options.pose_refinement, orb, camera, bf),
      relocalizer_(options.relocalization, alignment_),
      initializer_(options.initialization, camera),
      keyframe_decision_(options.keyframes) {}

void Tracker::resume(int num_keyframes, int next_place) {
  num_proposed_ = num_keyframes;
  next_place_ = next_place;
  reference_ = KeyframeId(num_keyframes - 1);
  lost_frames_ = 1;
}

TrackingResult Tracker::track(const std::shared_ptr<const FeatureFrame>& frame, std::shared_ptr<const MapSnapshot> map,
                              bool may_become_keyframe) {
  map_ = std::move(map);
  if (map_) {
    pending_.update(*map_);
    relocalizer_.update(*map_);
  }
  if (num_proposed_ == 0) {
    return may_become_keyframe ? start_map(frame) : lost(*frame, "waiting for the first keyframe");
  }

  if (!last_) {  // Resumed: the search for a place in the old map begins now.
    auto nothing = std::make_shared<FeatureFrame>();
    nothing->timestamp_ns = frame->timestamp_ns;
    last_ = nothing;
  }

  std::optional<Located> located = locate(*frame);
  if (located && is_certain(*located)) {
    count_sightings(*located);
    return tracked(frame, std::move(*located), may_become_keyframe);
  }
  const double gap_s = 1e-9 * static_cast<double>(frame->timestamp_ns - last_->timestamp_ns);
  if (gap_s > options_.recently_lost_s && may_become_keyframe) {
    TrackingResult result = start_map(frame);
    if (result.has_pose) return result;
  }
  const char* few = frame->size() < 50 ? "too little texture" : "too few matches";
  return lost(*frame, located ? "too few landmarks of the local map" : few);
}

bool Tracker::is_certain(const Located& located) const {
  return located.num_inliers >= options_.min_inliers && located.share >= options_.min_found_share;
}

/// Where the motion leads to; where the map looks like the frame, if nothing or too little of the map is found there.
std::optional<Tracker::Located> Tracker::locate(const FeatureFrame& frame) {
  std::optional<Located> located;
  SE3 predicted;
  if (lost_frames_ == 0 && track_last_frame(frame, predicted)) located = track_local_map(frame, predicted, reference_);
  if ((located && is_certain(*located)) || !map_) return located;
  if (const auto found = relocalizer_.relocalize(*map_, frame, reference_)) {
    Located elsewhere = track_local_map(frame, found->camera_from_world, found->keyframe);
    elsewhere.is_relocalized = true;
    if (!located || elsewhere.num_inliers > located->num_inliers) located = std::move(elsewhere);
  }
  return located;
}

/// Begins a map with this frame. Its world is that of its first keyframe, moved aside from those of earlier maps.
TrackingResult Tracker::start_map(const std::shared_ptr<const FeatureFrame>& frame) {
  TrackingResult result;
  result.num_features = static_cast<int>(frame->size());
  const SE3 first_from_world(Quat::Identity(), Vec3(-kMapSpacing * next_place_, 0, 0));
  FrameMatches matches(frame->size());
  if (bf_ > 0) {
    result.num_inliers = static_cast<int>(std::ranges::count_if(frame->depth, [](float d) { return d > 0; }));
    if (result.num_inliers < options_.min_initial_landmarks) {
      return lost(*frame, fmt::format("{} keypoints with depth, {} needed", result.num_inliers,
                                      options_.min_initial_landmarks));
    }
    reference_ = KeyframeId{};
    result.camera_from_world = first_from_world;
    result.keyframe = propose(frame, result, matches);
  } else {
    std::string reason;
    const auto pair = initializer_.add(frame, reason);
    if (!pair) return lost(*frame, std::move(reason));
    InitialKeyframe initial{KeyframeId(num_proposed_++), pair->first, first_from_world, {}};
    Points points;
    const SE3 world_from_first = first_from_world.inverse();
    for (const auto& [first_keypoint, second_keypoint, in_first] : pair->points) {
      initial.points.emplace_back(first_keypoint, in_first);
      points.push_back({first_keypoint, in_first});
      const auto i = static_cast<size_t>(second_keypoint);
      matches.point[i] = {LandmarkId{}, {initial.id, first_keypoint}, world_from_first * in_first};
      matches.matched[i] = 1;
    }
    pending_.add(initial.id, initial.frame, KeyframeId{}, initial.camera_from_world, 1.0, std::move(points));
    reference_ = initial.id;
    result.num_inliers = static_cast<int>(pair->points.size());
    result.camera_from_reference = pair->second_from_first;
    result.camera_from_world = pair->second_from_first * first_from_world;
    result.keyframe = propose(frame, result, matches);
    result.keyframe->initial = std::move(initial);
    initializer_.restart();
  }
  ++next_place_;
  result.state = TrackingState::tracking;
  result.has_pose = true;
  result.reference = reference_;
  result.camera_from_reference = SE3{};
  last_ = frame;
  last_matches_ = std::move(matches);
  last_camera_from_reference_ = SE3{};
  last_reference_scale_ = 1.0;
  velocity_.reset();
  lost_frames_ = 0;
  return result;
}

TrackingResult Tracker::lost(const FeatureFrame& frame, std::string reason) {
  TrackingResult result;
  result.reason = std::move(reason);
  result.num_features = static_cast<int>(frame.size());
  if (num_proposed_ == 0) return result;
  ++lost_frames_;
  velocity_.reset();
  const double gap_s = 1e-9 * static_cast<double>(frame.timestamp_ns - last_->timestamp_ns);
  result.state = gap_s <= options_.recently_lost_s ? TrackingState::recently_lost : TrackingState::lost;
  return result;
}

TrackingResult Tracker::tracked(const std::shared_ptr<const FeatureFrame>& frame, Located located,
                                bool may_become_keyframe) {
  const SE3& camera_from_world = located.camera_from_world;
  velocity_.reset();
  if (located.is_relocalized) lost_frames_ = std::max(lost_frames_, 1);  // the last frame tells no velocity
  reference_ = located.reference;
  const auto elapsed = static_cast<double>(frame->timestamp_ns - last_->timestamp_ns);
  if (lost_frames_ == 0 && elapsed > 0) velocity_ = (camera_from_world * last_pose().inverse()).log() / elapsed;
  lost_frames_ = 0;
  initializer_.restart();

  TrackingResult result;
  result.state = TrackingState::tracking;
  result.has_pose = true;
  result.camera_from_world = camera_from_world;
  result.reference = reference_;
  result.camera_from_reference = camera_from_world * pose_of(reference_).inverse();
  result.reference_scale = scale_of(reference_);
  result.num_features = static_cast<int>(frame->size());
  result.num_inliers = located.num_inliers;
  if (may_become_keyframe &&
      keyframe_decision_.should_insert(frame->timestamp_ns, camera_from_world, located.num_inliers,
                                       median_depth(camera_from_world, located.matches))) {
    result.keyframe = propose(frame, result, located.matches);
    result.reference = reference_;
    result.camera_from_reference = SE3{};
    result.reference_scale = scale_of(reference_);
  }
  last_ = frame;
  last_matches_ = std::move(located.matches);
  last_camera_from_reference_ = result.camera_from_reference;
  last_reference_scale_ = result.reference_scale;
  return result;
}

/// As the map knows it now: it follows its reference keyframe, and grows with it.
SE3 Tracker::last_pose() const {
  SE3 camera_from_reference = last_camera_from_reference_;
  camera_from_reference.translation *= growth_since_last();
  return camera_from_reference * pose_of(reference_);
}

/// Looks up what the map now knows of the points that the last frame saw.
void Tracker::resolve_last_matches() {
  const SE3 world_from_last = last_pose().inverse();
  for (size_t i = 0; i < last_->size(); ++i) {
    TrackedPoint& point = last_matches_.point[i];
    if (last_matches_.matched[i] && map_ && map_->has(point.same_as.keyframe)) {
      const std::vector<LandmarkId>& landmarks = map_->keyframe(point.same_as.keyframe).keyframe.landmarks;
      const auto index = static_cast<size_t>(point.same_as.keypoint);
      point.landmark = index < landmarks.size() ? landmarks[index] : LandmarkId{};  // none once it is culled
      point.same_as = {};
    }
    if (const LandmarkView* view = map_ ? map_->find(point.landmark) : nullptr) {
      point.position = view->position;
    } else if (const auto seen = last_matches_.matched[i] ? pending_.point(point.same_as, map_.get()) : std::nullopt) {
      point.position = *seen;
    } else if (!last_matches_.matched[i] || !point.same_as.keyframe.valid()) {
      last_matches_.matched[i] = 0;
      if (!(last_->depth[i] > 0)) continue;
      const auto depth = static_cast<double>(last_->depth[i]);
      point = {{}, {}, world_from_last * camera_.unproject(last_->observations[i].pixel, depth)};
      last_matches_.matched[i] = 1;
    }
  }
}

bool Tracker::track_last_frame(const FeatureFrame& frame, SE3& camera_from_world) {
  resolve_last_matches();
  camera_from_world = last_pose();
  if (velocity_) {
    const auto elapsed = static_cast<double>(frame.timestamp_ns - last_->timestamp_ns);
    Vec6 motion = *velocity_ * elapsed;
    motion.head<3>() *= growth_since_last();
    camera_from_world = SE3::exp(motion) * camera_from_world;
  }
  // Without a velocity the points near by may be far from where they were. Those far away would vouch for a camera at
  // rest: the most numerous consensus decides.
  constexpr double kWide = 4.0;
  for (const double widening : {1.0, kWide}) {
    if (!velocity_ && widening < kWide) continue;
    alignment_.projector().clear();
    const auto radius = static_cast<float>(options_.last_frame_radius_px * widening);
    for (size_t i = 0; i < last_->size(); ++i) {
      if (!last_matches_.matched[i]) continue;
      alignment_.projector().add(camera_from_world, last_matches_.point[i], last_->features, i, radius);
    }
    FrameMatches matches(frame.size());
    SE3 refined = camera_from_world;
    if (alignment_.match(frame, {}, matches) < options_.min_inliers) continue;
    if (widening == kWide) {
      const auto consensus = alignment_.estimate(options_.relocalization.pose_ransac, frame, matches);
      if (!consensus) continue;
      refined = *consensus;
    }
    if (alignment_.refine(frame, matches, refined) >= options_.min_inliers / 2) {
      camera_from_world = refined;
      return true;
    }
  }
  return false;
}

Tracker::Located Tracker::track_local_map(const FeatureFrame& frame, const SE3& camera_from_world,
                                          KeyframeId reference) {
  Located result;
  result.camera_from_world = camera_from_world;
  result.reference = reference;
  result.matches = FrameMatches(frame.size());
  MatchOptions match_options;
  match_options.max_ratio = 0.85;
  match_options.check_rotation = false;
  const auto radius = static_cast<float>(options_.local_map_radius_px);
  PlaceEvidence evidence(camera_.width, camera_.height, frame.features);
  const LandmarkProjector& projected = alignment_.projector();
  const auto match_and_expect = [&] {
    alignment_.match(frame, match_options, result.matches);
    for (const auto& query : projected.queries()) evidence.expect(query.x, query.y);
  };
  if (map_) {
    alignment_.project_landmarks(camera_from_world, *map_, local_keyframes(camera_from_world), radius, result.matches);
    match_and_expect();
    for (size_t i = 0; i < projected.size(); ++i) result.visible.push_back(projected.point(i).landmark);
  }
  // What the newest keyframes measured, until the map has landmarks for it.
  alignment_.projector().clear();
  pending_.for_each_point(map_.get(), [&](const LandmarkObservation& seen, const FeatureFrame& by, const Vec3& point) {
    alignment_.projector().add(camera_from_world, {LandmarkId{}, seen, point}, by.features,
                               static_cast<size_t>(seen.keypoint), radius);
  });
  match_and_expect();

  result.num_inliers = alignment_.refine(frame, result.matches, result.camera_from_world);
  if (evidence.findable() > 0) result.share = static_cast<double>(result.num_inliers) / evidence.findable();
  return result;
}

void Tracker::count_sightings(const Located& located) {
  for (const LandmarkId id : located.visible) ++sightings_[id].visible;
  for (size_t i = 0; i < located.matches.matched.size(); ++i) {
    const LandmarkId id = located.matches.point[i].landmark;
    if (located.matches.matched[i] && id.valid()) ++sightings_[id].found;
  }
}

std::vector<KeyframeId> Tracker::local_keyframes(const SE3& camera_from_world) const {
  constexpr double kOverlap = 2.0;  // views farther apart than this (see view_distance) hardly share landmarks
  std::vector<std::pair<double, KeyframeId>> candidates;
  for (const auto& view : map_->keyframes) {
    if (view->keyframe.culled) continue;
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

KeyframeProposal Tracker::propose(const std::shared_ptr<const FeatureFrame>& frame, const TrackingResult& result,
                                  const FrameMatches& matches) {
  KeyframeProposal proposal;
  proposal.id = KeyframeId(num_proposed_++);
  proposal.frame = frame;
  proposal.reference = reference_;
  proposal.camera_from_reference = reference_.valid() ? result.camera_from_reference : result.camera_from_world;
  proposal.reference_scale = scale_of(reference_);
  proposal.landmarks.resize(frame->size());
  proposal.sightings = std::move(sightings_);
  sightings_.clear();
  Points points;
  for (size_t i = 0; i < frame->size(); ++i) {
    const int keypoint = static_cast<int>(i);
    const TrackedPoint& point = matches.point[i];
    if (matches.matched[i] && point.landmark.valid()) {
      proposal.landmarks[i] = point.landmark;
    } else if (matches.matched[i] && point.same_as.keyframe.valid()) {
      proposal.same_as.emplace_back(keypoint, point.same_as);
    } else if (frame->depth[i] > 0) {
      points.push_back(
          {keypoint, camera_.unproject(frame->observations[i].pixel, static_cast<double>(frame->depth[i]))});
    }
  }
  pending_.add(proposal.id, frame, proposal.reference, proposal.camera_from_reference, proposal.reference_scale,
               std::move(points));
  reference_ = proposal.id;
  keyframe_decision_.inserted(frame->timestamp_ns, result.camera_from_world);
  return proposal;
}

}  // namespace photoslam
