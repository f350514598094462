// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "loop_closure/loop_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/median.h"

namespace photoslam {
namespace {

/// Those that share landmarks with a keyframe, at least a quarter as many as the one that shares most: drift lets a few
/// of an old place fit by chance, long before its loop is closed.
std::vector<KeyframeId> neighbours(const MapSnapshot& map, KeyframeId id) {
  std::vector<KeyframeId> result;
  const auto& covisible = map.keyframe(id).covisible;
  for (const auto& [keyframe, shared] : covisible) {
    if (4 * shared >= covisible.front().shared_landmarks) result.push_back(keyframe);
  }
  return result;
}

/// The keyframe, its neighbours, and theirs.
std::set<KeyframeId> connected(const MapSnapshot& map, KeyframeId id) {
  std::set<KeyframeId> result{id};
  for (const KeyframeId first : neighbours(map, id)) {
    result.insert(first);
    for (const KeyframeId second : neighbours(map, first)) result.insert(second);
  }
  return result;
}

}  // namespace

void LoopDetectorOptions::visit(OptionVisitor& v) {
  v.value({"max_candidates", "", 1, 100, "Similar keyframes that are verified for each new one."}, max_candidates);
  v.value({"min_keyframe_gap", "", 1, 10000, "A loop spans at least so many keyframes of one map."}, min_keyframe_gap);
  v.value({"min_matches", "", 6, 1000, "Descriptor matches a candidate needs."}, min_matches);
  v.value({"min_guided_matches", "", 6, 10000, "Landmarks of the old place that must be found again and agree, …"},
          min_guided_matches);
  v.value(
      {"min_guided_share", "", 0.0, 1.0, "… or this share of the keypoints whose depth the keyframe knows, if fewer."},
      min_guided_share);
  evidence.visit(v);
  v.value({"search_radius_px", "px", 0.5, 100.0, "Search radius around a predicted landmark."}, search_radius_px);
  v.value({"min_shift_px", "px", 0.0, 1000.0, "Landmarks that are less away from where the loop wants them need none."},
          min_shift_px);
  v.value({"neighbourhood", "", 0, 1000, "Keyframes whose landmarks make up a place."}, neighbourhood);
  v.value({"confirming_keyframes", "", 0, 100, "Keyframes next to the new one that are asked for confirmation …"},
          confirming_keyframes);
  v.value({"min_confirmations", "", 0, 100, "… and how many of them must give it."}, min_confirmations);
  v.group("ransac", "Robust transform between two keyframes.", ransac);
}

std::vector<LandmarkId> landmarks_around(const MapSnapshot& map, KeyframeId id, int count) {
  std::set<LandmarkId> result;
  const auto take = [&](KeyframeId keyframe) {
    for (LandmarkId landmark : map.keyframe(keyframe).keyframe.landmarks) {
      if (map.find(landmark) != nullptr) result.insert(landmark);
    }
  };
  take(id);
  for (const auto& neighbour : map.keyframe(id).covisible) {
    if (--count < 0) break;
    take(neighbour.keyframe);
  }
  return {result.begin(), result.end()};
}

LoopDetector::LoopDetector(const LoopDetectorOptions& options, const OrbOptions& orb, const PinholeCamera& camera,
                           double bf, bool with_scale)
    : options_(options), camera_(camera), bf_(bf), with_scale_(with_scale), projector_(orb, camera, bf) {}

std::optional<Loop> LoopDetector::detect(const MapSnapshot& map, KeyframeId now) {
  std::optional<Loop> met;
  for (const KeyframeId then : similar_places(map, map.keyframe(now).keyframe)) {
    auto loop = verify(map, then, now);
    if (!loop) continue;
    loop->is_met = is_met(map, *loop);
    if (!loop->is_met && confirm(map, *loop)) return loop;
    if (loop->is_met && !met && is_news(map, *loop)) met = std::move(loop);
  }
  return met;
}

void LoopDetector::add(const MapSnapshot& map, KeyframeId id) {
  index_.add(id.value, strongest_descriptors(map.keyframe(id).keyframe.frame->features));
}

/// Culled keyframes are no places any more: others see what they saw.
std::vector<KeyframeId> LoopDetector::similar_places(const MapSnapshot& map, const Keyframe& now) {
  const std::vector<Descriptor> descriptors = strongest_descriptors(now.frame->features);
  const std::set<KeyframeId> known = connected(map, now.id);
  const auto accept = [&](int place) {
    const KeyframeId then(place);
    const bool is_long_ago = now.id.value - then.value >= options_.min_keyframe_gap;
    return !known.contains(then) && (is_long_ago || map.root_of(then) != map.root_of(now.id));
  };
  index_.remove_if([&](int place) { return map.keyframe(KeyframeId(place)).keyframe.culled; });
  std::vector<KeyframeId> places;
  for (const PlaceCandidate& candidate : index_.query(descriptors, options_.max_candidates, accept)) {
    places.emplace_back(candidate.place);
  }
  index_.add(now.id.value, descriptors);
  return places;
}

/// Where a keypoint's landmark is, or what its depth says.
std::optional<Vec3> LoopDetector::point_in_camera(const MapSnapshot& map, const Keyframe& keyframe,
                                                  size_t keypoint) const {
  LandmarkId id = keyframe.landmarks[keypoint];
  if (const LandmarkView* view = map.find(id)) return keyframe.camera_from_world * view->position;
  const auto depth = static_cast<double>(keyframe.frame->depth[keypoint]);
  if (depth > 0) return camera_.unproject(keyframe.frame->observations[keypoint].pixel, depth);
  return std::nullopt;
}

std::vector<PointMatch> LoopDetector::match_features(const MapSnapshot& map, const Keyframe& then,
                                                     const Keyframe& now) const {
  MatchOptions match_options;
  match_options.max_distance = 64;
  match_options.max_ratio = 0.85;
  std::vector<int> now_of_then;
  match_brute_force(match_options, then.frame->features, now.frame->features, now_of_then);
  std::vector<PointMatch> matches;
  for (size_t i = 0; i < now_of_then.size(); ++i) {
    if (now_of_then[i] == kNoMatch) continue;
    const auto j = static_cast<size_t>(now_of_then[i]);
    const auto in_then = point_in_camera(map, then, i), in_now = point_in_camera(map, now, j);
    if (!in_then || !in_now) continue;
    const PixelObservation &seen_then = then.frame->observations[i], &seen_now = now.frame->observations[j];
    matches.push_back({*in_then, *in_now, seen_then.pixel, seen_now.pixel, 1 / std::sqrt(seen_then.inverse_variance),
                       1 / std::sqrt(seen_now.inverse_variance)});
  }
  return matches;
}

LoopDetector::Search LoopDetector::search(const MapSnapshot& map, std::span<const LandmarkId> landmarks,
                                          const SE3& camera_from_world, const Keyframe& keyframe, double radius_px) {
  projector_.clear();
  for (LandmarkId id : landmarks) {
    if (const LandmarkView* view = map.find(id)) {
      projector_.add(camera_from_world, id, *view, static_cast<float>(radius_px));
    }
  }
  MatchOptions match_options;
  match_options.max_distance = 64;
  match_options.check_rotation = false;
  std::vector<int> keypoint_of_query;
  matcher_.match(match_options, {keyframe.frame->features, keyframe.frame->grid, {}, {}}, projector_.queries(),
                 keypoint_of_query);
  Search result;
  PlaceEvidence evidence(camera_.width, camera_.height, keyframe.frame->features);
  for (size_t i = 0; i < keypoint_of_query.size(); ++i) {
    const ProjectionQuery& query = projector_.queries()[i];
    evidence.expect(query.x, query.y);
    if (keypoint_of_query[i] == kNoMatch) continue;
    evidence.find(query.x, query.y);
    result.matches.emplace_back(projector_.point(i).landmark, keypoint_of_query[i]);
  }
  result.is_same_place = evidence.suffices(options_.evidence);
  return result;
}

/// Whether as many matches agree as fix the transform well, or as a keyframe that knows little can be asked for.
bool LoopDetector::is_precise(const MapSnapshot& map, const Loop& loop) const {
  const Keyframe& now = map.keyframe(loop.now).keyframe;
  int known = 0;
  for (size_t i = 0; i < now.landmarks.size(); ++i) known += point_in_camera(map, now, i).has_value();
  const double needed = std::min<double>(options_.min_guided_matches, options_.min_guided_share * known);
  return static_cast<double>(loop.matches.size()) >= needed;
}

std::optional<Loop> LoopDetector::verify(const MapSnapshot& map, KeyframeId then_id, KeyframeId now_id) {
  const Keyframe &then = map.keyframe(then_id).keyframe, &now = map.keyframe(now_id).keyframe;
  const std::vector<PointMatch> pairs = match_features(map, then, now);
  if (static_cast<int>(pairs.size()) < options_.min_matches) return std::nullopt;
  SimilarityResult found = estimate_similarity_ransac(options_.ransac, camera_, with_scale_, pairs);
  if (!found.success) return std::nullopt;

  Loop loop{then_id, now_id, found.b_from_a, {}, landmarks_around(map, then_id, options_.neighbourhood)};
  const Sim3 then_from_world(then.camera_from_world);
  Search seen;
  for (const double radius : {options_.search_radius_px, 0.7 * options_.search_radius_px}) {
    const SE3 now_from_world = (loop.now_from_then * then_from_world).rigid();
    seen = search(map, loop.landmarks, now_from_world, now, radius);
    std::vector<PointMatch> guided;
    std::vector<std::pair<LandmarkId, int>> usable;
    for (const auto& [id, keypoint] : seen.matches) {
      const auto j = static_cast<size_t>(keypoint);
      LandmarkId landmark = id;
      const Vec3 in_then = then.camera_from_world * map.find(landmark)->position;
      const auto in_now = point_in_camera(map, now, j);
      if (!in_now || !(in_then.z() > 0)) continue;
      const PixelObservation& observed = now.frame->observations[j];
      const double sigma = 1 / std::sqrt(observed.inverse_variance);
      guided.push_back({in_then, *in_now, camera_.project(in_then), observed.pixel, sigma, sigma});
      usable.emplace_back(id, keypoint);
    }
    found = refine_similarity(options_.ransac, camera_, with_scale_, guided, loop.now_from_then);
    if (!found.success) return std::nullopt;
    loop.now_from_then = found.b_from_a;
    loop.matches.clear();
    for (size_t i = 0; i < usable.size(); ++i) {
      if (found.inlier[i]) loop.matches.push_back(usable[i]);
    }
  }
  return seen.is_same_place && is_precise(map, loop) ? std::optional(loop) : std::nullopt;
}

/// Whether the map has the landmarks already where the loop wants them in the image, and not by chance.
bool LoopDetector::is_met(const MapSnapshot& map, const Loop& loop) const {
  if (map.root_of(loop.then) != map.root_of(loop.now)) return false;
  const SE3& then_from_world = map.keyframe(loop.then).keyframe.camera_from_world;
  const SE3& now_from_world = map.keyframe(loop.now).keyframe.camera_from_world;
  std::vector<double> shifts;  // [px]
  for (auto [id, keypoint] : loop.matches) {
    const LandmarkView* landmark = map.find(id);
    if (landmark == nullptr) continue;
    const Vec3 is = now_from_world * landmark->position;
    const Vec3 wanted = loop.now_from_then * (then_from_world * landmark->position);
    const bool in_front = is.z() > 0 && wanted.z() > 0;
    shifts.push_back(in_front ? (camera_.project(is) - camera_.project(wanted)).norm()
                              : std::numeric_limits<double>::infinity());
  }
  return shifts.empty() || lower_median(shifts) < options_.min_shift_px;
}

/// Whether most of what was found again are other landmarks than the map has there.
bool LoopDetector::is_news(const MapSnapshot& map, const Loop& loop) const {
  const Keyframe& now = map.keyframe(loop.now).keyframe;
  const auto known = std::ranges::count_if(loop.matches, [&](const auto& match) {
    LandmarkId present = now.landmarks[static_cast<size_t>(match.second)];
    return map.find(present) != nullptr && present == match.first;
  });
  return 2 * known < std::ssize(loop.matches);
}

bool LoopDetector::confirm(const MapSnapshot& map, const Loop& loop) {
  const std::set<KeyframeId> old_place = connected(map, loop.then);
  const SE3& then_from_world = map.keyframe(loop.then).keyframe.camera_from_world;
  const SE3 world_from_now = map.keyframe(loop.now).keyframe.camera_from_world.inverse();
  int asked = 0, confirmed = 0;
  for (const auto& neighbour : map.keyframe(loop.now).covisible) {
    if (asked >= options_.confirming_keyframes || confirmed >= options_.min_confirmations) break;
    if (old_place.contains(neighbour.keyframe)) continue;
    ++asked;
    const Keyframe& keyframe = map.keyframe(neighbour.keyframe).keyframe;
    const Sim3 neighbour_from_now(keyframe.camera_from_world * world_from_now);
    const SE3 pose = (neighbour_from_now * loop.now_from_then * Sim3(then_from_world)).rigid();
    const Search seen = search(map, loop.landmarks, pose, keyframe, options_.search_radius_px);
    confirmed += seen.is_same_place;
  }
  return confirmed >= options_.min_confirmations;
}

}  // namespace photoslam
