// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/triangulation.h"

#include <cmath>

namespace photoslam {
namespace {

Vec3 ray(const PinholeCamera& camera, const Vec2& pixel) { return camera.unproject(pixel, 1.0).normalized(); }

bool reprojects(const PinholeCamera& camera, const PointView& view, const Vec3& point, double max_chi2) {
  const Vec3 x = view.camera_from_world * point;
  return x.z() > 0 && (camera.project(x) - view.pixel).squaredNorm() <= max_chi2 * view.sigma * view.sigma;
}

}  // namespace

double parallax_angle(const Vec3& point, const Vec3& center_a, const Vec3& center_b) {
  const Vec3 a = center_a - point, b = center_b - point;
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

std::optional<Vec3> triangulate(const PinholeCamera& camera, const PointView& a, const PointView& b,
                                const TriangulationLimits& limits) {
  const SE3 world_from_a = a.camera_from_world.inverse(), world_from_b = b.camera_from_world.inverse();
  const Vec3 ray_a = world_from_a.rotation * ray(camera, a.pixel);
  const Vec3 ray_b = world_from_b.rotation * ray(camera, b.pixel);
  const Vec3 normal = ray_a.cross(ray_b);
  const double sine = normal.norm();
  if (!(std::atan2(sine, ray_a.dot(ray_b)) >= limits.min_parallax) || sine == 0) return std::nullopt;

  // Distances along the rays by the law of sines, then the mean of the two ends weighted by inverse distance (Lee &
  // Civera 2019).
  const Vec3 baseline = world_from_b.translation - world_from_a.translation;
  const double distance_a = ray_b.cross(baseline).norm() / sine, distance_b = ray_a.cross(baseline).norm() / sine;
  const Vec3 end_a = world_from_a.translation + distance_a * ray_a;
  const Vec3 end_b = world_from_b.translation + distance_b * ray_b;
  Vec3 point = (distance_b * end_a + distance_a * end_b) / (distance_a + distance_b);
  if (!point.allFinite()) return std::nullopt;
  // Rays that diverge meet behind the cameras; the unsigned distances then give a point that reprojects nowhere near.
  if (!reprojects(camera, a, point, limits.max_chi2) || !reprojects(camera, b, point, limits.max_chi2)) {
    return std::nullopt;
  }
  return point;
}

}  // namespace photoslam
