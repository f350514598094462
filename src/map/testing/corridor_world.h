// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "map/map.h"
#include "map/testing/point_world.h"

namespace photoslam::testing {

/// Corridors of points, a camera that walks through them, and the map that odometry with drift would make of it: for
/// tests of loop closure without images.
struct CorridorWorld {
  static constexpr double kStep = 0.3;       ///< [m] between keyframes
  static constexpr double kHalfWidth = 1.0;  ///< [m] of the corridor; half its height too
  PointWorld world{1, 0};
  std::vector<SE3> truth;  ///< [K] camera_from_world

  /// A square of corridors of this side length, walked once and a little further.
  static CorridorWorld square(double side, uint64_t seed, double points_per_metre = 70) {
    CorridorWorld result(seed);
    const auto pose_at = [side](double s) {
      s = std::fmod(s, 4 * side);
      const int edge = static_cast<int>(s / side);
      const double along = s - edge * side;
      const std::array<Vec3, 4> corner{Vec3(0, 0, 0), Vec3(0, 0, side), Vec3(side, 0, side), Vec3(side, 0, 0)};
      const std::array<Vec3, 4> direction{Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(-1, 0, 0)};
      // Turns over the last and first 1.5 m of an edge, so that views overlap.
      constexpr double kTurn = 1.5;
      double angle = 0.5 * std::numbers::pi * edge;
      if (along > side - kTurn) angle += 0.25 * std::numbers::pi * (along - (side - kTurn)) / kTurn;
      if (along < kTurn) angle -= 0.25 * std::numbers::pi * (kTurn - along) / kTurn;
      const auto e = static_cast<size_t>(edge);
      return SE3(so3_exp(Vec3(0, angle, 0)), corner[e] + along * direction[e]);
    };
    for (int edge = 0; edge < 4; ++edge) {
      const SE3 frame = pose_at((edge + 0.5) * side);
      result.add_walls(frame * SE3(Quat::Identity(), Vec3(0, 0, -0.5 * side)), -kHalfWidth, side + kHalfWidth,
                       points_per_metre);
    }
    // The turn at the start is the end of the last edge.
    for (double s = kStep; s < 4 * side + 4.0; s += kStep) result.truth.push_back(pose_at(s).inverse());
    result.rebase();
    return result;
  }

  /// A straight corridor with the same door every few metres and walls that differ in between.
  static CorridorWorld repeated_doors(double length, double spacing, uint64_t seed) {
    CorridorWorld result(seed);
    result.add_walls(SE3{}, 0, length + 6, 45);
    PointWorld door(seed + 1, 0);
    Random random(seed + 2);
    for (int i = 0; i < 120; ++i) {
      door.points.push_back({kHalfWidth, random.uniform(-1, 1), random.uniform(0, 1)});
      Descriptor& d = door.descriptors.emplace_back();
      for (uint64_t& word : d) word = random.next();
    }
    for (double z = 1; z < length + 4; z += spacing) {
      for (size_t i = 0; i < door.points.size(); ++i) {
        result.world.points.push_back(door.points[i] + Vec3(0, 0, z));
        result.world.descriptors.push_back(door.descriptors[i]);
      }
    }
    for (double z = 0; z < length; z += kStep) result.truth.push_back(SE3(Quat::Identity(), Vec3(0, 0, z)).inverse());
    return result;
  }

  /// The map of a walk whose steps are wrong by a random twist each, and of landmarks that are lost after a few
  /// keyframes: a place seen again is mapped anew. `scale_drift`: relative growth per step (monocular). `renewal`: how
  /// often a landmark is not recognised in the next keyframe, and made once more.
  Map drifted_map(double translation_error, double rotation_error, double scale_drift, bool with_depth, uint64_t seed,
                  double renewal = 0) {
    Map map(PointWorld::kScaleFactor, PointWorld::kNumLevels);
    Random random(seed);
    struct Track {
      LandmarkId landmark;
      int last_seen = 0;
    };
    std::map<int, Track> tracks;
    SE3 pose = truth[0];
    double scale = 1;
    // Drift has a direction: an uncalibrated camera bends every step the same way.
    const Vec3 bend =
        rotation_error * Vec3(0.3 * random.normal(), random.uniform() < 0.5 ? 1 : -1, 0.3 * random.normal());
    for (size_t k = 0; k < truth.size(); ++k) {
      const KeyframeId id(static_cast<int32_t>(k));
      if (k > 0) {
        SE3 step = truth[k] * truth[k - 1].inverse();
        scale *= 1 + scale_drift;
        step.translation *= scale;
        Vec6 error;
        for (int i = 0; i < 3; ++i) error[i] = scale * translation_error * random.normal();
        error.tail<3>() = bend;
        pose = SE3::exp(error) * step * pose;
      }
      auto frame = std::const_pointer_cast<FeatureFrame>(world.observe(truth[k], static_cast<int>(k)));
      if (!with_depth) {
        std::ranges::fill(frame->depth, 0.0f);
        for (auto& o : frame->observations) o.u_right = std::numeric_limits<double>::quiet_NaN();
      }
      map.add_keyframe(id, frame, pose);
      if (k > 0) map.set_parent(id, KeyframeId(id.value - 1));
      for (size_t i = 0; i < frame->size(); ++i) {
        const int point = world.point_of_keypoint[i];
        constexpr int kLost = 8;
        const auto track = tracks.find(point);
        const bool is_followed = track != tracks.end() && static_cast<int>(k) - track->second.last_seen < kLost;
        if (is_followed && (renewal == 0 || random.uniform() >= renewal)) {
          map.add_observation(track->second.landmark, id, static_cast<int>(i));
          track->second.last_seen = static_cast<int>(k);
          continue;
        }
        const Vec3 position = pose.inverse() * (scale * (truth[k] * world.points[static_cast<size_t>(point)]));
        tracks[point] = {map.add_landmark(position, id, static_cast<int>(i)), static_cast<int>(k)};
      }
    }
    for (size_t i = 0; i < map.num_landmarks(); ++i) map.update_view(LandmarkId(static_cast<int32_t>(i)));
    return map;
  }

  double path_length() const {
    double sum = 0;
    for (size_t k = 1; k < truth.size(); ++k) sum += (truth[k] * truth[k - 1].inverse()).translation.norm();
    return sum;
  }

 private:
  explicit CorridorWorld(uint64_t seed) : world(seed, 0), random_(seed) {
    world.pixel_noise = 0.5;
    world.farthest_visible = 5;
    world.flipped_bits = 0.04;
  }

  /// Points on the two walls, floor and ceiling of a straight piece along z.
  void add_walls(const SE3& world_from_piece, double begin, double end, double points_per_metre) {
    const int count = static_cast<int>((end - begin) * points_per_metre);
    for (int i = 0; i < count; ++i) {
      const double side = random_.uniform() < 0.5 ? -kHalfWidth : kHalfWidth;
      Vec3 p(side, random_.uniform(-kHalfWidth, kHalfWidth), random_.uniform(begin, end));
      if (random_.uniform() < 0.3) std::swap(p.x(), p.y());
      world.points.push_back(world_from_piece * p);
      Descriptor& d = world.descriptors.emplace_back();
      for (uint64_t& word : d) word = random_.next();
    }
  }

  /// Makes the first camera the origin of the world.
  void rebase() {
    const SE3 first_from_world = truth[0], world_from_first = first_from_world.inverse();
    for (SE3& pose : truth) pose = pose * world_from_first;
    for (Vec3& point : world.points) point = first_from_world * point;
  }

  Random random_;
};

}  // namespace photoslam::testing
