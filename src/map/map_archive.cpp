// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/map.h"
#include "math/archive.h"

namespace photoslam {

void serialize(Archive& a, Keypoint& k) { a(k.x, k.y, k.angle, k.response, k.octave); }

void serialize(Archive& a, PixelObservation& o) { a(o.pixel, o.u_right, o.inverse_variance); }

void serialize(Archive& a, LandmarkObservation& o) { a(o.keyframe, o.keypoint); }

void serialize(Archive& a, Landmark& l, LandmarkId& replaced_by) {
  LandmarkView& v = l.view;
  a(v.position, v.normal, v.min_distance, v.max_distance, v.descriptor, v.alive, replaced_by);
  a(l.observations, l.created_by, l.times_visible, l.times_found);
}

void serialize(Archive& a, FeatureFrame& f) {
  a(f.frame, f.timestamp_ns, f.features.keypoints, f.features.descriptors, f.depth, f.observations);
}

void Map::serialize(Archive& a, int image_width, int image_height) {
  a(scale_factor_, num_levels_, num_corrections_, adjustment_is_due_);
  keyframes_.resize(a.count(keyframes_.size()));
  for (size_t i = 0; i < keyframes_.size(); ++i) {
    Keyframe& k = keyframes_[i];
    FeatureFrame frame;
    if (!a.reading()) frame = *k.frame;
    a(k.id, frame, k.camera_from_world, k.landmarks, k.parent, k.scale, k.culled, k.from_parent);
    if (!a.reading()) continue;
    frame.grid.build(frame.features.keypoints, image_width, image_height);
    k.frame = std::make_shared<const FeatureFrame>(std::move(frame));
    changed_keyframes_.insert(k.id);
  }
  if (a.reading()) {
    anchors_.clear();
    for (const Keyframe& k : keyframes_) {
      if (k.culled) anchors_[k.parent].push_back(k.id);
    }
  }
  landmarks_.resize(a.count(landmarks_.size()));
  for (size_t i = 0; i < landmarks_.size(); ++i) {
    LandmarkSlot& slot = landmarks_[i];
    Landmark landmark;
    if (!a.reading() && slot.living) landmark = *slot.living;
    photoslam::serialize(a, landmark, slot.replaced_by);
    if (!a.reading()) continue;
    slot.living = landmark.view.alive ? std::make_unique<Landmark>(std::move(landmark)) : nullptr;
    changed_chunks_.insert(static_cast<int>(i) / LandmarkChunk::kSize);
  }
}

}  // namespace photoslam
