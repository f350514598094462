// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/map.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/check.h"
#include "math/median.h"

namespace photoslam {
namespace {

constexpr int kMinCovisibleLandmarks = 15;

/// The descriptor with the smallest median distance to the others.
Descriptor most_central(const std::vector<const Descriptor*>& descriptors) {
  size_t best = 0;
  int best_median = 257;
  std::vector<int> distances(descriptors.size());
  for (size_t i = 0; i < descriptors.size(); ++i) {
    for (size_t j = 0; j < descriptors.size(); ++j) distances[j] = hamming_distance(*descriptors[i], *descriptors[j]);
    if (const int median = lower_median(distances); median < best_median) {
      best_median = median;
      best = i;
    }
  }
  return *descriptors[best];
}

double median_landmark_depth(const Map& map, const Keyframe& keyframe) {
  std::vector<double> depths;
  for (const LandmarkId id : keyframe.landmarks) {
    if (id.valid()) depths.push_back((keyframe.camera_from_world * map.landmark(id).view.position).z());
  }
  return depths.empty() ? 0 : lower_median(depths);
}

}  // namespace

Map::Map(double scale_factor, int num_levels) : scale_factor_(scale_factor), num_levels_(num_levels) {}

Keyframe& Map::mutable_keyframe(KeyframeId id) {
  PHOTOSLAM_CHECK(id.valid() && static_cast<size_t>(id.value) < keyframes_.size(), "keyframe {}", id.value);
  changed_keyframes_.insert(id);
  return keyframes_[static_cast<size_t>(id.value)];
}

const Landmark& Map::landmark(LandmarkId id) const {
  static const Landmark kDead;
  const Landmark* living = landmarks_.find(id);
  return living != nullptr ? *living : kDead;
}

LandmarkId Map::living(LandmarkId id) const {
  while (id.valid() && landmarks_.find(id) == nullptr) id = landmarks_.replacement(id);
  return id;
}

/// nullptr: it is dead.
Landmark* Map::mutable_landmark(LandmarkId id) {
  PHOTOSLAM_CHECK(id.valid() && static_cast<size_t>(id.value) < landmarks_.size(), "landmark {}", id.value);
  mark_changed(id);
  return landmarks_.find(id);
}

void Map::bury(LandmarkId id) {
  mark_changed(id);
  landmarks_.bury(id);
}

void Map::replace(LandmarkId id, LandmarkId by) {
  mark_changed(id);
  if (const LandmarkId forgotten = landmarks_.replace(id, by); forgotten.valid()) mark_changed(forgotten);
}

Keyframe& Map::add_keyframe(KeyframeId id, std::shared_ptr<const FeatureFrame> frame, const SE3& camera_from_world) {
  PHOTOSLAM_CHECK(static_cast<size_t>(id.value) == keyframes_.size(), "keyframe {} after {}", id.value,
                  keyframes_.size());
  Keyframe& keyframe = keyframes_.emplace_back();
  keyframe.id = id;
  keyframe.landmarks.resize(frame->size());
  keyframe.frame = std::move(frame);
  keyframe.camera_from_world = camera_from_world;
  return mutable_keyframe(id);
}

LandmarkId Map::add_landmark(const Vec3& position, KeyframeId keyframe, int keypoint) {
  const LandmarkId id = landmarks_.give_out(1);
  Landmark& landmark = landmarks_.insert(id);
  landmark.view.position = position;
  landmark.view.alive = true;
  landmark.created_by = keyframe;
  add_observation(id, keyframe, keypoint);
  update_view(id);
  return id;
}

bool Map::add_observation(LandmarkId id, KeyframeId keyframe_id, int keypoint) {
  Landmark* landmark = mutable_landmark(id);
  if (!landmark) return false;
  Keyframe& keyframe = mutable_keyframe(keyframe_id);
  LandmarkId& slot = keyframe.landmarks.at(static_cast<size_t>(keypoint));
  const bool seen =
      std::ranges::any_of(landmark->observations, [&](const auto& o) { return o.keyframe == keyframe_id; });
  if (seen || slot.valid()) return false;
  slot = id;
  landmark->observations.push_back({keyframe_id, keypoint});
  return true;
}

void Map::remove_observation(LandmarkId id, KeyframeId keyframe) {
  Landmark* landmark = mutable_landmark(id);
  if (!landmark) return;
  std::erase_if(landmark->observations, [&](const LandmarkObservation& o) {
    if (o.keyframe != keyframe) return false;
    mutable_keyframe(keyframe).landmarks[static_cast<size_t>(o.keypoint)] = LandmarkId{};
    return true;
  });
  if (landmark->observations.empty()) bury(id);
}

void Map::erase_landmark(LandmarkId id) {
  const Landmark* landmark = mutable_landmark(id);
  if (!landmark) return;
  for (const auto& [keyframe, keypoint] : landmark->observations) {
    mutable_keyframe(keyframe).landmarks[static_cast<size_t>(keypoint)] = LandmarkId{};
  }
  bury(id);
}

void Map::fuse(LandmarkId from, LandmarkId to) {
  if (from == to) return;
  const std::vector<LandmarkObservation> moved = landmark(from).observations;
  count_sightings(to, landmark(from).times_visible, landmark(from).times_found);
  erase_landmark(from);
  for (const auto& [keyframe, keypoint] : moved) add_observation(to, keyframe, keypoint);
  replace(from, to);
  update_view(to);
}

void Map::update_view(LandmarkId id) {
  Landmark* landmark = mutable_landmark(id);
  if (!landmark) return;
  LandmarkView& view = landmark->view;
  Vec3 direction_sum = Vec3::Zero();
  std::vector<const Descriptor*> descriptors;
  for (const auto& [keyframe_id, keypoint] : landmark->observations) {
    const Keyframe& observer = keyframe(keyframe_id);
    direction_sum += (view.position - observer.camera_from_world.inverse().translation).normalized();
    descriptors.push_back(&observer.frame->features.descriptors[static_cast<size_t>(keypoint)]);
  }
  view.normal = direction_sum.normalized();
  view.descriptor = most_central(descriptors);

  const auto& [first_id, first_keypoint] = landmark->observations.front();
  const Keyframe& first = keyframe(first_id);
  const double distance = (first.camera_from_world * view.position).norm();
  const int octave = first.frame->features.keypoints[static_cast<size_t>(first_keypoint)].octave;
  view.max_distance = distance * std::pow(scale_factor_, octave);
  view.min_distance = view.max_distance / std::pow(scale_factor_, num_levels_ - 1);
}

void Map::set_position(LandmarkId id, const Vec3& position) {
  if (Landmark* landmark = mutable_landmark(id)) landmark->view.position = position;
}

void Map::set_pose(KeyframeId id, const SE3& camera_from_world) {
  mutable_keyframe(id).camera_from_world = camera_from_world;
  const auto anchors = anchors_.find(id);
  if (anchors == anchors_.end()) return;
  for (const KeyframeId anchor : anchors->second) {
    mutable_keyframe(anchor).camera_from_world = keyframe(anchor).from_parent * camera_from_world;
  }
}

/// From now on the culled keyframe moves with this parent.
void Map::tie(KeyframeId anchor, KeyframeId parent) {
  Keyframe& tied = mutable_keyframe(anchor);
  tied.parent = parent;
  tied.from_parent = tied.camera_from_world * keyframe(parent).camera_from_world.inverse();
  anchors_[parent].push_back(anchor);
}

void Map::cull_keyframe(KeyframeId id) {
  Keyframe& culled = mutable_keyframe(id);
  PHOTOSLAM_CHECK(culled.parent.valid() && !culled.culled, "keyframe {}", id.value);
  for (const LandmarkId landmark : std::vector<LandmarkId>(culled.landmarks)) {
    if (!landmark.valid()) continue;
    remove_observation(landmark, id);
    update_view(landmark);
  }
  auto without_features = std::make_shared<FeatureFrame>();
  without_features->frame = culled.frame->frame;
  without_features->timestamp_ns = culled.frame->timestamp_ns;
  culled.frame = std::move(without_features);
  culled.landmarks = std::vector<LandmarkId>();
  culled.culled = true;

  tie(id, culled.parent);
  if (auto own = anchors_.extract(id)) {
    for (const KeyframeId anchor : own.mapped()) tie(anchor, culled.parent);
  }
  for (const Keyframe& other : keyframes_) {
    if (other.parent == id) set_parent(other.id, culled.parent);
  }
}

void Map::apply(const MapCorrection& correction) {
  ++num_corrections_;
  adjustment_is_due_ = correction.adjustment_is_due.value_or(adjustment_is_due_);
  if (correction.new_world_from_old_world.empty()) return;
  std::vector<Sim3> moves;  // [K] new_world_from_old_world
  for (const Keyframe& keyframe : keyframes_) {
    const auto id = static_cast<size_t>(keyframe.id.value);
    if (id < correction.new_world_from_old_world.size()) {
      moves.push_back(correction.new_world_from_old_world[id]);
    } else {
      moves.push_back(keyframe.parent.valid() ? moves[static_cast<size_t>(keyframe.parent.value)] : Sim3{});
    }
  }
  for (const auto& [parent, anchors] : anchors_) {
    const Sim3& move = moves[static_cast<size_t>(parent.value)];
    for (const KeyframeId anchor : anchors) {
      moves[static_cast<size_t>(anchor.value)] = move;
      mutable_keyframe(anchor).from_parent.translation *= move.scale;
    }
  }
  for (Keyframe& keyframe : keyframes_) {
    const Sim3& move = moves[static_cast<size_t>(keyframe.id.value)];
    keyframe.scale *= move.scale;
    if (!keyframe.culled) set_pose(keyframe.id, (Sim3(keyframe.camera_from_world) * move.inverse()).rigid());
  }
  for (const LandmarkId id : landmarks_.living()) {
    const KeyframeId reference =
        std::ranges::min(landmark(id).observations, {}, &LandmarkObservation::keyframe).keyframe;
    Vec3 position = moves[static_cast<size_t>(reference.value)] * landmark(id).view.position;
    if (const auto shift = correction.landmark_shifts.find(id); shift != correction.landmark_shifts.end()) {
      position += shift->second;
    }
    set_position(id, position);
    update_view(id);
  }
  for (const auto& [child, parent] : correction.joints) join(child, parent);
}

void Map::join(KeyframeId child, KeyframeId parent) {
  const auto root_of = [this](KeyframeId id) {
    while (keyframe(id).parent.valid()) id = keyframe(id).parent;
    return id;
  };
  PHOTOSLAM_CHECK(root_of(child) != root_of(parent), "keyframes {} and {} are in one tree", child.value, parent.value);
  parent = living(parent);
  for (child = living(child); child.valid();) {
    const KeyframeId next = keyframe(child).parent;
    set_parent(child, parent);
    parent = child;
    child = next;
  }
}

void Map::append(const Map& other) {
  adjustment_is_due_ |= other.adjustment_is_due_;
  const auto num_keyframes = static_cast<int32_t>(keyframes_.size());
  const auto num_landmarks = static_cast<int32_t>(landmarks_.size());
  const auto count_on = [&](auto& id) {
    constexpr bool kOfKeyframe = std::is_same_v<std::remove_reference_t<decltype(id)>, KeyframeId>;
    if (id.valid()) id.value += kOfKeyframe ? num_keyframes : num_landmarks;
  };
  for (Keyframe keyframe : other.keyframes_) {
    count_on(keyframe.id);
    count_on(keyframe.parent);
    std::ranges::for_each(keyframe.landmarks, count_on);
    changed_keyframes_.insert(keyframe.id);
    if (keyframe.culled) anchors_[keyframe.parent].push_back(keyframe.id);
    keyframes_.push_back(std::move(keyframe));
  }
  landmarks_.give_out(other.num_landmarks());
  for (const LandmarkId theirs : other.landmarks_.living()) {
    LandmarkId id = theirs;
    count_on(id);
    Landmark& landmark = landmarks_.insert(id);
    landmark = other.landmark(theirs);
    count_on(landmark.created_by);
    for (LandmarkObservation& o : landmark.observations) count_on(o.keyframe);
  }
  for (LandmarkId id : other.landmarks_.replaced()) {
    LandmarkId by = other.landmarks_.replacement(id);
    count_on(id);
    count_on(by);
    replace(id, by);
  }
  for (int i = num_landmarks; i < static_cast<int>(landmarks_.size()); ++i) mark_changed(LandmarkId(i));
}

void Map::count_sightings(LandmarkId id, int visible, int found) {
  Landmark* landmark = landmarks_.find(id);  // no reader sees the counters
  if (!landmark) return;
  landmark->times_visible += visible;
  landmark->times_found += found;
}

std::vector<CovisibleKeyframe> Map::covisible_keyframes(KeyframeId id, int min_shared) const {
  std::map<KeyframeId, int> shared;
  for (const LandmarkId landmark_id : keyframe(id).landmarks) {
    if (!landmark_id.valid()) continue;
    for (const LandmarkObservation& o : landmark(landmark_id).observations) ++shared[o.keyframe];
  }
  std::vector<CovisibleKeyframe> result;
  for (const auto& [other, count] : shared) {
    if (other != id && count >= min_shared) result.push_back({other, count});
  }
  std::ranges::stable_sort(result,
                           [](const auto& a, const auto& b) { return a.shared_landmarks > b.shared_landmarks; });
  return result;
}

LandmarkChunk Map::chunk(int index) const {
  LandmarkChunk result;
  const int begin = index * LandmarkChunk::kSize;
  const int end = std::min(begin + LandmarkChunk::kSize, static_cast<int>(landmarks_.size()));
  for (int i = begin; i < end; ++i) {
    const LandmarkId id(i);
    if (const Landmark* living = landmarks_.find(id)) {
      result.add(i - begin, living->view);
    } else if (const LandmarkId by = landmarks_.replacement(id); by.valid()) {
      result.replace(i - begin, by);
    }
  }
  return result;
}

std::shared_ptr<const MapSnapshot> Map::snapshot() {
  auto next = published_ ? std::make_shared<MapSnapshot>(*published_) : std::make_shared<MapSnapshot>();
  ++next->version;
  next->num_corrections = num_corrections_;
  next->adjustment_is_due = adjustment_is_due_;
  next->keyframes.resize(keyframes_.size());
  for (const KeyframeId id : changed_keyframes_) {
    const Keyframe& current = keyframe(id);
    next->keyframes[static_cast<size_t>(id.value)] = std::make_shared<const KeyframeView>(
        KeyframeView{current, covisible_keyframes(id, kMinCovisibleLandmarks), median_landmark_depth(*this, current)});
  }
  next->num_landmarks = static_cast<int>(landmarks_.size());
  next->landmark_chunks.resize((landmarks_.size() + LandmarkChunk::kSize - 1) / LandmarkChunk::kSize);
  static const auto kEmpty = std::make_shared<const LandmarkChunk>();
  for (const int index : changed_chunks_) {
    LandmarkChunk changed = chunk(index);
    next->landmark_chunks[static_cast<size_t>(index)] =
        changed.empty() ? kEmpty : std::make_shared<const LandmarkChunk>(std::move(changed));
  }
  changed_keyframes_.clear();
  changed_chunks_.clear();
  published_ = next;
  return published_;
}

}  // namespace photoslam
