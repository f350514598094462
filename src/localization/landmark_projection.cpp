// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/landmark_projection.h"

#include <algorithm>
#include <cmath>

namespace photoslam {
namespace {

constexpr double kMinViewCosine = 0.5;
// The distance range of a landmark is exact for its first observation only; allow for one pyramid level of error.
constexpr double kRangeTolerance = 1.2;

}  // namespace

LandmarkProjector::LandmarkProjector(const OrbOptions& orb, const PinholeCamera& camera, double bf)
    : log_scale_factor_(std::log(orb.scale_factor)), num_levels_(orb.num_levels), camera_(camera), bf_(bf) {
  for (int level = 0; level < num_levels_; ++level) {
    level_scale_.push_back(static_cast<float>(std::pow(orb.scale_factor, level)));
  }
}

void LandmarkProjector::clear() {
  queries_.clear();
  points_.clear();
}

bool LandmarkProjector::project(const SE3& camera_from_world, const Vec3& position, ProjectionQuery& query) const {
  const Vec3 x = camera_from_world * position;
  if (!(x.z() > 0.05)) return false;
  const Vec2 pixel = camera_.project(x);
  if (!camera_.contains(pixel)) return false;
  query.x = static_cast<float>(pixel.x());
  query.y = static_cast<float>(pixel.y());
  query.u_right = static_cast<float>(pixel.x() - bf_ / x.z());
  return true;
}

void LandmarkProjector::add(const SE3& camera_from_world, LandmarkId id, const LandmarkView& view, float radius_px) {
  ProjectionQuery query;
  if (!project(camera_from_world, view.position, query)) return;
  const Vec3 ray = view.position - camera_from_world.inverse().translation;
  const double distance = ray.norm();
  if (distance < view.min_distance / kRangeTolerance || distance > view.max_distance * kRangeTolerance) return;
  if (ray.dot(view.normal) < kMinViewCosine * distance) return;

  const double level = std::ceil(std::log(view.max_distance / distance) / log_scale_factor_);
  const int predicted = std::clamp(static_cast<int>(level), 0, num_levels_ - 1);
  query.min_octave = std::max(predicted - 1, 0);
  query.max_octave = std::min(predicted + 1, num_levels_ - 1);
  query.radius = radius_px * level_scale_[static_cast<size_t>(predicted)];
  query.descriptor = view.descriptor;
  queries_.push_back(query);
  points_.push_back({id, {}, view.position});
}

void LandmarkProjector::add(const SE3& camera_from_world, const TrackedPoint& point, const Features& seen, size_t index,
                            float radius_px) {
  ProjectionQuery query;
  if (!project(camera_from_world, point.position, query)) return;
  const Keypoint& keypoint = seen.keypoints[index];
  query.min_octave = std::max(keypoint.octave - 1, 0);
  query.max_octave = std::min(keypoint.octave + 1, num_levels_ - 1);
  query.radius = radius_px * level_scale_[static_cast<size_t>(keypoint.octave)];
  query.angle = keypoint.angle;
  query.descriptor = seen.descriptors[index];
  queries_.push_back(query);
  points_.push_back(point);
}

}  // namespace photoslam
