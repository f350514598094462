// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "base/random.h"
#include "camera/pinhole.h"
#include "map/keyframe.h"

namespace photoslam::testing {

/// A world of points on the walls of a box around the origin, each with a descriptor of its own, for tests of tracking
/// and mapping without images: features are exact projections, with the noise asked for. As in real images, a nearer
/// point appears on a coarser octave, where positions are less exact.
class PointWorld {
 public:
  static constexpr double kScaleFactor = 1.2;
  static constexpr int kNumLevels = 8;
  static constexpr double kFarthest = 5.5;  ///< Distance [m] of points that appear on octave 0.
  PinholeCamera camera{640, 480, 525, 525, 321.5, 238.25};
  double bf = 105;
  double pixel_noise = 0;         ///< σ [px] on octave 0
  double wrong_share = 0;         ///< Features displaced at random.
  double farthest_visible = 1e9;  ///< [m]
  bool with_depth = true;
  double flipped_bits = 0;  ///< Share of the bits of each descriptor that differ from view to view.

  explicit PointWorld(uint64_t seed = 1, int num_points = 10000) : random_(seed) {
    for (int i = 0; i < num_points; ++i) {
      Vec3 p(random_.uniform(-3, 3), random_.uniform(-2, 2), random_.uniform(-3, 3));
      const int axis = random_.index(3);
      const double half[3] = {3, 2, 3};
      p[axis] = random_.uniform() < 0.5 ? -half[axis] : half[axis];
      points.push_back(p);
      Descriptor& d = descriptors.emplace_back();
      for (uint64_t& word : d) word = random_.next();
    }
  }

  /// What a camera sees.
  std::shared_ptr<const FeatureFrame> observe(const SE3& camera_from_world, int id, double frames_per_second = 30) {
    auto frame = std::make_shared<FeatureFrame>();
    frame->frame = FrameId(id);
    frame->timestamp_ns = static_cast<int64_t>(1e9 * id / frames_per_second);
    point_of_keypoint.clear();
    for (size_t i = 0; i < points.size(); ++i) {
      const Vec3 x = camera_from_world * points[i];
      if (x.z() < 0.3 || x.norm() > farthest_visible || !camera.contains(camera.project(x), 10)) continue;
      Vec2 pixel = camera.project(x);
      const double z = x.z();
      const int octave = std::clamp(
          static_cast<int>(std::lround(std::log(kFarthest / x.norm()) / std::log(kScaleFactor))), 0, kNumLevels - 1);
      const double scale = std::pow(kScaleFactor, octave);
      if (pixel_noise > 0) pixel += scale * pixel_noise * Vec2(random_.normal(), random_.normal());
      if (random_.uniform() < wrong_share) pixel += Vec2(random_.uniform(-9, 9), random_.uniform(-9, 9));
      Keypoint keypoint;
      keypoint.x = static_cast<float>(pixel.x());
      keypoint.y = static_cast<float>(pixel.y());
      keypoint.octave = octave;
      frame->features.keypoints.push_back(keypoint);
      frame->features.descriptors.push_back(descriptors[i]);
      if (flipped_bits > 0) flip(frame->features.descriptors.back());
      PixelObservation& observation = frame->observations.emplace_back();
      observation.pixel = pixel;
      observation.inverse_variance = 1.0 / (scale * scale);
      if (with_depth) observation.u_right = pixel.x() - bf / z;
      frame->depth.push_back(with_depth ? static_cast<float>(z) : 0.0f);
      point_of_keypoint.push_back(static_cast<int>(i));
    }
    frame->grid.build(frame->features.keypoints, camera.width, camera.height);
    return frame;
  }

  /// A smooth walk with turns; the first pose is the identity.
  static SE3 camera_from_world(double seconds) {
    const double s = seconds;
    const Vec3 position(0.8 * std::sin(0.7 * s), 0.2 * std::sin(1.1 * s), 0.6 * (1 - std::cos(0.5 * s)));
    const Quat rotation = so3_exp(Vec3(0.1 * std::sin(0.9 * s), 0.5 * std::sin(0.6 * s), 0.05 * std::sin(1.3 * s)));
    return SE3(rotation, position).inverse();
  }

  std::vector<Vec3> points;
  std::vector<Descriptor> descriptors;
  std::vector<int> point_of_keypoint;  ///< Of the last frame observed.

 private:
  void flip(Descriptor& descriptor) {
    for (int bit = 0; bit < 256; ++bit) {
      if (random_.uniform() < flipped_bits) descriptor[static_cast<size_t>(bit / 64)] ^= uint64_t{1} << (bit % 64);
    }
  }

  Random random_;
};

}  // namespace photoslam::testing
