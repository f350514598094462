// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "geometry/testing/textured_wall.h"
#include "map/map.h"

namespace photoslam::testing {

/// Keyframes before a textured wall, with landmarks at exact positions, as geometry mapping would deliver them.
class WallWithKeyframes {
 public:
  explicit WallWithKeyframes(const PinholeCamera& camera) : camera_(camera) {}

  void add(const SE3& camera_from_world) {
    const KeyframeId id(static_cast<int32_t>(map_.num_keyframes()));
    auto frame = std::make_shared<FeatureFrame>();
    std::vector<Vec3> points;
    const int step = camera_.width / 16;
    for (int y = step; y < camera_.height - step; y += step) {
      for (int x = step; x < camera_.width - step; x += step) {
        Keypoint keypoint;
        keypoint.x = static_cast<float>(x);
        keypoint.y = static_cast<float>(y);
        frame->features.keypoints.push_back(keypoint);
        frame->features.descriptors.push_back({});
        frame->observations.push_back({.pixel = Vec2(x, y)});
        const double depth = wall.look(camera_, camera_from_world, x, y).depth;
        points.push_back(camera_from_world.inverse() * camera_.unproject(Vec2(x, y), depth));
      }
    }
    frame->depth.assign(points.size(), 0.0f);
    map_.add_keyframe(id, frame, camera_from_world);
    // Each keyframe sees its own landmarks and half of those of the one before, so that they are covisible.
    for (size_t i = 0; i < points.size(); ++i) {
      const bool shared = id.value > 0 && i % 2 == 0;
      const LandmarkId landmark = shared ? LandmarkId(static_cast<int32_t>(i)) : LandmarkId();
      if (shared && map_.add_observation(landmark, id, static_cast<int>(i))) {
        map_.set_position(landmark, points[i]);
      } else {
        map_.update_view(map_.add_landmark(points[i], id, static_cast<int>(i)));
      }
    }
  }
  std::shared_ptr<const MapSnapshot> snapshot() { return map_.snapshot(); }
  void apply(const MapCorrection& correction) { map_.apply(correction); }
  ImageU8 picture(const SE3& camera_from_world) const { return wall.picture(camera_, camera_from_world); }

  TexturedWall wall;

 private:
  PinholeCamera camera_;
  Map map_{1.2, 8};
};

}  // namespace photoslam::testing
