// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry_mapping/geometry_mapper.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "base/archive.h"
#include "geometry/triangulation.h"
#include "geometry_mapping/epipolar_matching.h"

namespace photoslam {
namespace {

constexpr int kMinCovisible = 15;
constexpr int kMinBundleIterations = 2;  // also when the next keyframe is waiting
constexpr int kTrialKeyframes = 3;       // a young landmark must prove itself over this many keyframes

/// 95 % of χ² with two or, with depth, three degrees of freedom.
double max_chi2(const PixelObservation& observation) { return observation.has_depth() ? 7.815 : 5.991; }

}  // namespace

void GeometryMapperOptions::visit(OptionVisitor& v) {
  v.value({"local_keyframes", "", 2, 200, "Keyframes refined by local bundle adjustment, Eq. (2)."}, local_keyframes);
  v.value({"fixed_keyframes", "", 1, 500, "Further observers of the same landmarks held fixed."}, fixed_keyframes);
  v.value({"fusion_keyframes", "", 0, 100, "Covisible keyframes searched for duplicate landmarks."}, fusion_keyframes);
  v.value({"triangulation_keyframes", "", 0, 100, "Covisible keyframes with which new landmarks are triangulated."},
          triangulation_keyframes);
  v.value({"min_parallax_deg", "deg", 0.05, 45.0, "Angle between the rays of a triangulated landmark."},
          min_parallax_deg);
  v.value({"fusion_radius_px", "px", 0.5, 50.0, "Search radius for duplicates."}, fusion_radius_px);
  v.value(
      {"min_found_ratio", "", 0.0, 1.0, "Young landmarks matched in fewer of the frames that see them are removed."},
      min_found_ratio);
  v.value({"max_landmark_depth_baselines", "", 1.0, 1000.0,
           "Depth, in baselines of the stereo or depth camera, up to which one view makes a landmark."},
          max_landmark_depth_baselines);
  v.value(
      {"min_landmarks", "", 0, 10000, "The nearest make landmarks beyond that depth, too, until a keyframe has these."},
      min_landmarks);
  v.group("keyframe_culling", "When a keyframe becomes a mere anchor.", keyframe_culling);
  v.group("bundle", "The local bundle adjustment.", bundle);
}

GeometryMapper::GeometryMapper(const GeometryMapperOptions& options, const OrbOptions& orb, const PinholeCamera& camera,
                               double bf)
    : options_(options),
      camera_(camera),
      bf_(bf),
      map_(orb.scale_factor, orb.num_levels),
      projector_(orb, camera, bf) {}

GeometryUpdate GeometryMapper::process(const KeyframeProposal& proposal, const std::function<bool()>& interrupted) {
  const auto change = begin_change();
  GeometryUpdate update;
  update.keyframe = proposal.id;
  insert(proposal);
  update.culled_landmarks = cull_recent_landmarks(proposal.id);
  update.new_landmarks = create_measured_landmarks(proposal.id) + triangulate_landmarks(proposal.id);
  update.fused_landmarks = fuse_with_neighbours(proposal.id);
  update.moved_keyframes.push_back(proposal.id);
  update.bundle = adjust_locally(proposal.id, interrupted, update.moved_keyframes);
  update.culled_keyframes = cull_keyframes(proposal.id);
  update.map = map_.snapshot();
  return update;
}

std::shared_ptr<const MapSnapshot> GeometryMapper::correct(const MapCorrection& correction) {
  const auto change = begin_change();
  map_.apply(correction);
  // Landmarks may have been fused since the correction was computed, or by the duplicate before.
  for (const auto& [landmark, keyframe] : correction.wrong_observations) {
    const LandmarkId id = map_.living(landmark);
    if (!id.valid()) continue;
    map_.remove_observation(id, keyframe);
    map_.update_view(id);
  }
  for (const auto& [from, to] : correction.duplicates) {
    const LandmarkId duplicate = map_.living(from), kept = map_.living(to);
    if (duplicate.valid() && kept.valid()) map_.fuse(duplicate, kept);
  }
  for (const KeyframeId keyframe : correction.loop_keyframes) fuse_into(keyframe, correction.loop_landmarks);
  return map_.snapshot();
}

void GeometryMapper::append(const GeometryMapper& other) {
  const auto change = begin_change();
  map_.append(other.map_);
}

void GeometryMapper::serialize(Archive& archive) {
  wholeness_.check(kName);
  map_.serialize(archive, camera_.width, camera_.height);
  archive(recent_landmarks_);
}

void GeometryMapper::insert(const KeyframeProposal& proposal) {
  if (const auto& initial = proposal.initial) {
    map_.add_keyframe(initial->id, initial->frame, initial->camera_from_world);
    const SE3 world_from_camera = initial->camera_from_world.inverse();
    for (const auto& [keypoint, in_camera] : initial->points) {
      recent_landmarks_.push_back(map_.add_landmark(world_from_camera * in_camera, initial->id, keypoint));
    }
  }
  // The pose was estimated in an older map: it follows its reference keyframe into this one, and so does the unit in
  // which others measure from this keyframe already.
  SE3 camera_from_world = proposal.camera_from_reference;
  double scale = 1.0;
  if (proposal.reference.valid()) {
    const Keyframe& reference = map_.keyframe(proposal.reference);
    scale = reference.scale / proposal.reference_scale;
    camera_from_world.translation *= scale;
    camera_from_world = camera_from_world * reference.camera_from_world;
  }
  map_.add_keyframe(proposal.id, proposal.frame, camera_from_world).scale = scale;
  if (proposal.reference.valid()) map_.set_parent(proposal.id, map_.living(proposal.reference));
  for (const auto& [id, sighting] : proposal.sightings) map_.count_sightings(id, sighting.visible, sighting.found);
  for (size_t i = 0; i < proposal.landmarks.size(); ++i) {
    const LandmarkId id = map_.living(proposal.landmarks[i]);
    if (id.valid() && map_.add_observation(id, proposal.id, static_cast<int>(i))) map_.update_view(id);
  }
  for (const auto& [keypoint, seen] : proposal.same_as) {
    const std::vector<LandmarkId>& landmarks = map_.keyframe(seen.keyframe).landmarks;
    const auto index = static_cast<size_t>(seen.keypoint);
    if (index >= landmarks.size()) continue;  // it has been culled since
    const LandmarkId id = landmarks[index];
    if (id.valid() && map_.add_observation(id, proposal.id, keypoint)) map_.update_view(id);
  }
}

/// Whether a keyframe measured the depth of the landmark: one such view is worth two.
bool GeometryMapper::is_measured(const Landmark& landmark) const {
  return std::ranges::any_of(landmark.observations, [&](const LandmarkObservation& o) {
    return map_.keyframe(o.keyframe).frame->observations[static_cast<size_t>(o.keypoint)].has_depth();
  });
}

int GeometryMapper::cull_recent_landmarks(KeyframeId current) {
  int culled = 0;
  std::erase_if(recent_landmarks_, [&](LandmarkId id) {
    const Landmark& landmark = map_.landmark(id);
    if (!landmark.view.alive) return true;
    const int age = current.value - landmark.created_by.value;
    const bool rarely_found = landmark.times_found < options_.min_found_ratio * landmark.times_visible;
    const bool never_seen_again =
        age >= kTrialKeyframes && static_cast<int>(landmark.observations.size()) < (is_measured(landmark) ? 2 : 3);
    if (rarely_found || never_seen_again) {
      map_.erase_landmark(id);
      ++culled;
      return true;
    }
    return age >= kTrialKeyframes;
  });
  return culled;
}

/// Up to which depth the keyframe's measurements make landmarks. Where everything is far away, the nearest must do
/// until there is parallax to triangulate with.
double GeometryMapper::max_landmark_depth(const Keyframe& keyframe) const {
  const double near = options_.max_landmark_depth_baselines * bf_ / camera_.fx;
  int missing = options_.min_landmarks;
  std::vector<double> depths;
  for (size_t i = 0; i < keyframe.frame->size(); ++i) {
    const auto depth = static_cast<double>(keyframe.frame->depth[i]);
    if (keyframe.landmarks[i].valid()) {
      --missing;
    } else if (depth > 0) {
      depths.push_back(depth);
    }
  }
  if (missing <= 0 || depths.empty()) return near;
  std::ranges::sort(depths);
  return std::max(near, depths[std::min(static_cast<size_t>(missing), depths.size()) - 1]);
}

int GeometryMapper::create_measured_landmarks(KeyframeId id) {
  const Keyframe& keyframe = map_.keyframe(id);
  const double max_depth = max_landmark_depth(keyframe);
  int created = 0;
  for (size_t i = 0; i < keyframe.frame->size(); ++i) {
    const auto depth = static_cast<double>(keyframe.frame->depth[i]);
    if (keyframe.landmarks[i].valid() || !(depth > 0) || depth > max_depth) continue;
    const int keypoint = static_cast<int>(i);
    recent_landmarks_.push_back(map_.add_landmark(*measured_point(keyframe, keypoint), id, keypoint));
    ++created;
  }
  return created;
}

int GeometryMapper::triangulate_landmarks(KeyframeId id) {
  auto neighbours = map_.covisible_keyframes(id, kMinCovisible);
  neighbours.resize(std::min(neighbours.size(), static_cast<size_t>(options_.triangulation_keyframes)));
  int created = 0;
  for (const auto& neighbour : neighbours) created += triangulate_with(id, neighbour.keyframe);
  return created;
}

/// Whether the point reprojects where the keypoint is, its measured depth included.
bool GeometryMapper::fits(const Vec3& point, const Keyframe& keyframe, int keypoint) const {
  const PixelObservation& observation = keyframe.frame->observations[static_cast<size_t>(keypoint)];
  return reprojection_chi2(camera_, bf_, keyframe.camera_from_world, point, observation) <= max_chi2(observation);
}

/// Whether the pyramid levels of two keypoints differ as the distances of the point from both cameras do.
bool GeometryMapper::scales_agree(const Vec3& point, const Keyframe& a, int keypoint_a, const Keyframe& b,
                                  int keypoint_b) const {
  const auto size = [&](const Keyframe& k, int keypoint) {
    const PixelObservation& o = k.frame->observations[static_cast<size_t>(keypoint)];
    return (k.camera_from_world * point).norm() / std::sqrt(o.inverse_variance);
  };
  constexpr double kMaxRatio = 1.8;
  const double ratio = size(a, keypoint_a) / size(b, keypoint_b);
  return ratio < kMaxRatio && ratio > 1 / kMaxRatio;
}

/// Where the depth sensor puts what a keypoint sees; nothing where it measured nothing.
std::optional<Vec3> GeometryMapper::measured_point(const Keyframe& keyframe, int keypoint) const {
  const auto i = static_cast<size_t>(keypoint);
  const auto depth = static_cast<double>(keyframe.frame->depth[i]);
  if (!(depth > 0)) return std::nullopt;
  return keyframe.camera_from_world.inverse() * camera_.unproject(keyframe.frame->observations[i].pixel, depth);
}

/// Landmarks from keypoints of two keyframes that have none, where the rays of both meet at a sufficient angle.
int GeometryMapper::triangulate_with(KeyframeId id, KeyframeId other_id) {
  const Keyframe &keyframe = map_.keyframe(id), &other = map_.keyframe(other_id);
  const auto without_landmark = [](const Keyframe& k) {
    std::vector<uint8_t> result(k.landmarks.size());
    for (size_t i = 0; i < result.size(); ++i) result[i] = !k.landmarks[i].valid();
    return result;
  };
  const SE3 other_from_this = other.camera_from_world * keyframe.camera_from_world.inverse();
  const auto own = without_landmark(keyframe), others = without_landmark(other);
  const auto pairs =
      match_along_epipolar_lines(camera_, {*keyframe.frame, own}, {*other.frame, others}, other_from_this);
  const TriangulationLimits limits{.min_parallax = options_.min_parallax_deg * std::numbers::pi / 180};
  int created = 0;
  for (const auto& [i, j] : pairs) {
    const auto view = [](const Keyframe& k, int keypoint) {
      const PixelObservation& o = k.frame->observations[static_cast<size_t>(keypoint)];
      return PointView{k.camera_from_world, o.pixel, 1 / std::sqrt(o.inverse_variance)};
    };
    auto point = triangulate(camera_, view(keyframe, i), view(other, j), limits);
    // Too far for both cameras of the rig and for this motion to fix its depth: still good for the rotation.
    if (!point) point = measured_point(keyframe, i);
    if (!point || !fits(*point, keyframe, i) || !fits(*point, other, j)) continue;
    if (!scales_agree(*point, keyframe, i, other, j)) continue;
    const LandmarkId landmark = map_.add_landmark(*point, id, i);
    map_.add_observation(landmark, other_id, j);
    map_.update_view(landmark);
    recent_landmarks_.push_back(landmark);
    ++created;
  }
  return created;
}

int GeometryMapper::fuse_with_neighbours(KeyframeId id) {
  auto neighbours = map_.covisible_keyframes(id, kMinCovisible);
  neighbours.resize(std::min(neighbours.size(), static_cast<size_t>(options_.fusion_keyframes)));
  int fused = 0;
  std::set<LandmarkId> of_neighbours;
  for (const auto& neighbour : neighbours) {
    const std::vector<LandmarkId> own = map_.keyframe(id).landmarks;
    fused += fuse_into(neighbour.keyframe, own);
    for (const LandmarkId landmark : map_.keyframe(neighbour.keyframe).landmarks) {
      if (landmark.valid()) of_neighbours.insert(landmark);
    }
  }
  return fused + fuse_into(id, std::vector<LandmarkId>(of_neighbours.begin(), of_neighbours.end()));
}

int GeometryMapper::fuse_into(KeyframeId target_id, std::span<const LandmarkId> landmarks) {
  const Keyframe& target = map_.keyframe(target_id);
  projector_.clear();
  const std::set<LandmarkId> already(target.landmarks.begin(), target.landmarks.end());
  for (const LandmarkId id : landmarks) {
    if (!id.valid() || already.contains(id) || !map_.landmark(id).view.alive) continue;
    projector_.add(target.camera_from_world, id, map_.landmark(id).view, static_cast<float>(options_.fusion_radius_px));
  }
  MatchOptions match_options;
  match_options.max_distance = 50;
  match_options.check_rotation = false;
  std::vector<int> keypoint_of_query;
  matcher_.match(match_options, {target.frame->features, target.frame->grid, {}, {}}, projector_.queries(),
                 keypoint_of_query);
  int fused = 0;
  for (size_t query = 0; query < keypoint_of_query.size(); ++query) {
    if (keypoint_of_query[query] == kNoMatch) continue;
    const LandmarkId id = projector_.point(query).landmark;
    const auto keypoint = static_cast<size_t>(keypoint_of_query[query]);
    if (!map_.landmark(id).view.alive || !fits(map_.landmark(id).view.position, target, keypoint_of_query[query])) {
      continue;
    }
    const LandmarkId present = target.landmarks[keypoint];
    if (!present.valid()) {
      if (map_.add_observation(id, target_id, static_cast<int>(keypoint))) map_.update_view(id);
    } else if (present != id) {
      const bool keep_present = map_.landmark(present).observations.size() >= map_.landmark(id).observations.size();
      map_.fuse(keep_present ? id : present, keep_present ? present : id);
    }
    ++fused;
  }
  return fused;
}

void GeometryMapper::build_local_problem(KeyframeId id) {
  problem_.clear();
  problem_keyframes_.assign(1, id);
  for (const auto& neighbour : map_.covisible_keyframes(id, kMinCovisible)) {
    if (static_cast<int>(problem_keyframes_.size()) >= options_.local_keyframes) break;
    problem_keyframes_.push_back(neighbour.keyframe);
  }
  std::set<LandmarkId> landmarks;
  for (const KeyframeId keyframe : problem_keyframes_) {
    for (const LandmarkId landmark : map_.keyframe(keyframe).landmarks) {
      if (landmark.valid()) landmarks.insert(landmark);
    }
  }
  const size_t num_free = problem_keyframes_.size();
  std::map<KeyframeId, int> outer;  // observers outside the window, by number of shared landmarks
  for (const LandmarkId landmark : landmarks) {
    for (const auto& o : map_.landmark(landmark).observations) {
      if (std::ranges::find(problem_keyframes_, o.keyframe) == problem_keyframes_.end()) ++outer[o.keyframe];
    }
  }
  std::vector<std::pair<int, KeyframeId>> ring;
  for (const auto& [keyframe, count] : outer) ring.emplace_back(-count, keyframe);
  std::ranges::sort(ring);
  ring.resize(std::min(ring.size(), static_cast<size_t>(options_.fixed_keyframes)));
  for (const auto& entry : ring) problem_keyframes_.push_back(entry.second);

  std::map<KeyframeId, int> pose_index;
  for (const KeyframeId keyframe : problem_keyframes_) {
    const int index = static_cast<int>(problem_.camera_from_world.size());
    pose_index[keyframe] = index;
    problem_.camera_from_world.push_back(map_.keyframe(keyframe).camera_from_world);
    // The first keyframe defines the world.
    const bool fixed = static_cast<size_t>(index) >= num_free || !map_.keyframe(keyframe).parent.valid();
    problem_.pose_is_fixed.push_back(fixed ? 1 : 0);
  }
  if (std::ranges::count(problem_.pose_is_fixed, 1) == 0) {  // no outer ring: the oldest keyframe holds the window
    problem_.pose_is_fixed[static_cast<size_t>(pose_index.begin()->second)] = 1;
  }
  problem_landmarks_.clear();
  for (const LandmarkId landmark : landmarks) {
    const int point = static_cast<int>(problem_.points_in_world.size());
    problem_landmarks_.push_back(landmark);
    problem_.points_in_world.push_back(map_.landmark(landmark).view.position);
    for (const auto& [keyframe, keypoint] : map_.landmark(landmark).observations) {
      const auto pose = pose_index.find(keyframe);
      if (pose == pose_index.end()) continue;
      problem_.observations.push_back(
          {pose->second, point, map_.keyframe(keyframe).frame->observations[static_cast<size_t>(keypoint)]});
    }
  }
}

BundleSummary GeometryMapper::adjust_locally(KeyframeId id, const std::function<bool()>& interrupted,
                                             std::vector<KeyframeId>& moved) {
  if (map_.num_keyframes() < 2) return {};
  build_local_problem(id);
  const auto may_stop = [&interrupted, iterations = 0]() mutable {
    return iterations++ >= kMinBundleIterations && interrupted && interrupted();
  };
  const BundleSummary summary = adjuster_.solve(options_.bundle, camera_, bf_, problem_, may_stop);
  for (size_t i = 0; i < problem_keyframes_.size(); ++i) {
    if (problem_.pose_is_fixed[i]) continue;
    map_.set_pose(problem_keyframes_[i], problem_.camera_from_world[i]);
    if (problem_keyframes_[i] != id) moved.push_back(problem_keyframes_[i]);
  }
  for (size_t i = 0; i < problem_landmarks_.size(); ++i) {
    map_.set_position(problem_landmarks_[i], problem_.points_in_world[i]);
  }
  remove_outliers();
  for (const LandmarkId landmark : problem_landmarks_) map_.update_view(landmark);
  return summary;
}

/// Among those that see what the current keyframe sees.
int GeometryMapper::cull_keyframes(KeyframeId current) {
  const KeyframeCullingOptions& options = options_.keyframe_culling;
  if (!options.enabled) return 0;
  int culled = 0;
  for (const auto& neighbour : map_.covisible_keyframes(current, kMinCovisible)) {
    const KeyframeId id = neighbour.keyframe;
    const bool stays = !map_.keyframe(id).parent.valid() || current.value - id.value < options.min_age_keyframes;
    if (stays || !is_redundant(options, map_, id)) continue;
    map_.cull_keyframe(id);
    ++culled;
  }
  return culled;
}

void GeometryMapper::remove_outliers() {
  for (const auto& [pose, point, observation] : problem_.observations) {
    const double chi2 = reprojection_chi2(camera_, bf_, problem_.camera_from_world[static_cast<size_t>(pose)],
                                          problem_.points_in_world[static_cast<size_t>(point)], observation);
    if (chi2 > max_chi2(observation)) {
      map_.remove_observation(problem_landmarks_[static_cast<size_t>(point)],
                              problem_keyframes_[static_cast<size_t>(pose)]);
    }
  }
}

}  // namespace photoslam
