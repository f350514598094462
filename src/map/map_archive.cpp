// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/map.h"
#include "math/archive.h"

namespace photoslam {

void serialize(Archive& a, Keypoint& k) { a(k.x, k.y, k.angle, k.response, k.octave); }

void serialize(Archive& a, PixelObservation& o) { a(o.pixel, o.u_right, o.inverse_variance); }

void serialize(Archive& a, LandmarkObservation& o) { a(o.keyframe, o.keypoint); }

void serialize(Archive& a, Landmark& l) {
  LandmarkView& v = l.view;
  a(v.position, v.normal, v.min_distance, v.max_distance, v.descriptor, v.alive);
  a(l.observations, l.created_by, l.times_visible, l.times_found);
}

void serialize(Archive& a, FeatureFrame& f) {
  a(f.frame, f.timestamp_ns, f.features.keypoints, f.features.descriptors, f.depth, f.observations);
}

/// Of the dead only those that were replaced are written: a session does not grow with what its map no longer has.
void serialize(Archive& a, LandmarkTable& table) {
  std::vector<LandmarkId> living = table.living();
  std::vector<LandmarkId> replaced(table.replaced().begin(), table.replaced().end());
  uint64_t given_out = table.size();
  a(given_out, living, replaced);
  if (a.reading()) {
    table = {};
    table.give_out(given_out);
  }
  for (LandmarkId id : living) a(a.reading() ? table.insert(id) : *table.find(id));
  for (LandmarkId id : replaced) {
    LandmarkId by = table.replacement(id);
    a(by);
    if (a.reading()) table.replace(id, by);
  }
}

void Map::serialize(Archive& a, int image_width, int image_height) {
  a(scale_factor_, num_levels_, num_corrections_, adjustment_is_due_);
  if (a.reading()) {
    changed_keyframes_.clear();
    changed_chunks_.clear();
    anchors_.clear();
  }
  keyframes_.resize(a.count(keyframes_.size()));
  for (Keyframe& k : keyframes_) {
    FeatureFrame frame;
    if (!a.reading()) frame = *k.frame;
    a(k.id, frame, k.camera_from_world, k.landmarks, k.parent, k.scale, k.culled, k.from_parent);
    if (!a.reading()) continue;
    frame.grid.build(frame.features.keypoints, image_width, image_height);
    k.frame = std::make_shared<const FeatureFrame>(std::move(frame));
    changed_keyframes_.insert(k.id);
    if (k.culled) anchors_[k.parent].push_back(k.id);
  }
  a(landmarks_);
  if (!a.reading()) return;
  for (int i = 0; i < static_cast<int>(landmarks_.size()); ++i) mark_changed(LandmarkId(i));
}

}  // namespace photoslam
