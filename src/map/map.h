// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "map/landmark_table.h"
#include "map/map_correction.h"
#include "map/snapshot.h"

namespace photoslam {

class Archive;

/// The geometric half of the hyper primitives map: keyframes, landmarks and who sees what.
///
/// Invariant: keyframe k lists landmark l at keypoint i exactly when l's observations contain (k, i), and dead
/// landmarks have no observations. One thread writes; others read snapshots.
class Map {
 public:
  /// `scale_factor` of the feature pyramid and its number of levels, to predict the level a landmark appears on.
  Map(double scale_factor, int num_levels);

  /// Adds the next keyframe (its id must be keyframes().size()) without observations.
  Keyframe& add_keyframe(KeyframeId id, std::shared_ptr<const FeatureFrame> frame, const SE3& camera_from_world);
  LandmarkId add_landmark(const Vec3& position, KeyframeId keyframe, int keypoint);

  /// Ignored when the keyframe already sees the landmark or the keypoint already has one. Returns whether it was added.
  bool add_observation(LandmarkId landmark, KeyframeId keyframe, int keypoint);
  /// A landmark that loses its last observation dies.
  void remove_observation(LandmarkId landmark, KeyframeId keyframe);
  void erase_landmark(LandmarkId landmark);
  /// Moves all observations of `from` to `to`; `from` then points to `to`.
  void fuse(LandmarkId from, LandmarkId to);

  /// Recomputes normal, distance range and descriptor from the observations; call after they or poses changed.
  void update_view(LandmarkId landmark);
  void set_position(LandmarkId landmark, const Vec3& position);
  void set_pose(KeyframeId keyframe, const SE3& camera_from_world);
  /// Moves everything as the correction says (culled keyframes with their parents); what was added since it was
  /// computed follows its ancestors.
  void apply(const MapCorrection& correction);

  size_t num_keyframes() const { return keyframes_.size(); }
  size_t num_landmarks() const { return landmarks_.size(); }
  const Keyframe& keyframe(KeyframeId id) const { return keyframes_[static_cast<size_t>(id.value)]; }
  /// Of a dead one nothing is known any more.
  const Landmark& landmark(LandmarkId id) const;
  /// The landmark, or the one that took over its observations; invalid when it is dead.
  LandmarkId living(LandmarkId id) const;
  /// Counts sightings by tracked frames.
  void count_sightings(LandmarkId id, int visible, int found);
  void set_parent(KeyframeId keyframe, KeyframeId parent) { mutable_keyframe(keyframe).parent = parent; }
  /// Makes one spanning tree of two: that of `child` is turned to hang by it on `parent`, so that parents stay
  /// keyframes that see the same.
  void join(KeyframeId child, KeyframeId parent);
  /// Takes the keyframe out of geometry: it observes nothing any more, and follows its parent as an anchor of what was
  /// measured in its frame. Its children become its parent's. Not for the root of a spanning tree.
  void cull_keyframe(KeyframeId keyframe);
  /// The keyframe, or the parent that it follows since it was culled.
  KeyframeId living(KeyframeId id) const { return keyframe(id).culled ? keyframe(id).parent : id; }

  /// Keyframes sharing at least `min_shared` landmarks with this one, strongest first, ties by id.
  std::vector<CovisibleKeyframe> covisible_keyframes(KeyframeId id, int min_shared) const;

  /// Adds a map of its own, its ids counted on from those of this one. Nothing connects the two yet.
  void append(const Map& other);

  /// Writes the map, or replaces this one by the map read; `image_width` and `image_height` are those of its camera.
  void serialize(Archive& archive, int image_width, int image_height);

  /// Publishes the present state; unchanged parts are shared with the previous snapshot.
  std::shared_ptr<const MapSnapshot> snapshot();

 private:
  Keyframe& mutable_keyframe(KeyframeId id);
  void tie(KeyframeId anchor, KeyframeId parent);
  Landmark* mutable_landmark(LandmarkId id);
  void bury(LandmarkId id);
  void replace(LandmarkId id, LandmarkId by);
  void mark_changed(LandmarkId id) { changed_chunks_.insert(id.value / LandmarkChunk::kSize); }
  LandmarkChunk chunk(int index) const;

  double scale_factor_;
  int num_levels_;
  std::deque<Keyframe> keyframes_;
  LandmarkTable landmarks_;
  std::map<KeyframeId, std::vector<KeyframeId>> anchors_;  // culled keyframes by their parents, which are not culled
  std::set<KeyframeId> changed_keyframes_;                 // since the last snapshot
  std::set<int> changed_chunks_;
  int num_corrections_ = 0;
  bool adjustment_is_due_ = false;
  std::shared_ptr<const MapSnapshot> published_;
};

}  // namespace photoslam
