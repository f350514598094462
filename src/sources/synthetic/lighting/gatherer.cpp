// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/lighting/gatherer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "sources/synthetic/textures/noise.h"

namespace photoslam::synthetic {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kSide = 4;                   // strata per axis: one packet of 16 rays per light
constexpr int kBounceSide = 8;             // strata per axis of the hemisphere
constexpr float kSurfaceOffset = 1.5e-3f;  // [m], keeps a surface from shadowing itself
static_assert(kSide * kSide == RayTracer::kRays);

/// Stratum i of the square [-1, 1]², shifted by a random amount that wraps around.
Vec2f on_square(int i, uint32_t seed) {
  const float x = (static_cast<float>(i % kSide) + 0.5f) / kSide + hash01(1, 0, seed);
  const int row = i / kSide;
  const float y = (static_cast<float>(row) + 0.5f) / kSide + hash01(2, 0, seed);
  return {2 * (x - std::floor(x)) - 1, 2 * (y - std::floor(y)) - 1};
}

/// count² points spread evenly over the unit disc. Source: Shirley and Chiu, "A low distortion map between disk and
/// square", 1997.
std::vector<Vec2f> disc_points(int count) {
  std::vector<Vec2f> points;
  for (int i = 0; i < count * count; ++i) {
    const float a = 2 * (static_cast<float>(i % count) + 0.5f) / static_cast<float>(count) - 1;
    const int row = i / count;
    const float b = 2 * (static_cast<float>(row) + 0.5f) / static_cast<float>(count) - 1;
    const bool wide = std::abs(a) > std::abs(b);
    const float r = wide ? a : b, angle = wide ? kPi / 4 * (b / a) : kPi / 2 - kPi / 4 * (a / b);
    points.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return points;
}

/// A turn by a random angle.
Eigen::Matrix2f random_turn(uint32_t seed) {
  return Eigen::Rotation2Df(2 * kPi * hash01(3, 0, seed)).toRotationMatrix();
}

}  // namespace

Gatherer::Gatherer(const RayTracer& tracer, const Lights& lights)
    : tracer_(tracer), lights_(lights), disc_(disc_points(kSide)), hemisphere_(disc_points(kBounceSide)) {}

Color Gatherer::direct(const Mesh::Surface& surface, uint32_t seed) const {
  Color sum = Color::Zero();
  for (size_t i = 0; i < lights_.areas.size(); ++i) {
    const auto [light, visible] = from_area(lights_.areas[i], surface, seed + static_cast<uint32_t>(i));
    sum += light;
    if (i == 0) sum[3] = visible;
  }
  return sum + from_sun(surface, seed + 77);
}

Color Gatherer::indirect(const Mesh::Surface& surface, uint32_t seed, Sampling sampling,
                         const Radiance& radiance) const {
  const std::vector<Vec2f>& points = sampling == Sampling::fine ? hemisphere_ : disc_;
  const auto [tangent, bitangent] = orthogonal_axes(surface.normal);
  RayTracer::Rays rays;
  RayTracer::Hits hits;
  rays.origin = surface.position + kSurfaceOffset * surface.normal;
  const Eigen::Matrix2f turn = random_turn(seed);
  Color sum = Color::Zero();
  for (size_t first = 0; first < points.size(); first += RayTracer::kRays) {
    for (int i = 0; i < RayTracer::kRays; ++i) {
      const Vec2f d = turn * points[first + static_cast<size_t>(i)];
      const float up = std::sqrt(std::max(1e-4f, 1 - d.squaredNorm()));
      rays.set(i, d.x() * tangent + d.y() * bitangent + up * surface.normal);
    }
    tracer_.intersect(rays, hits);
    for (int i = 0; i < RayTracer::kRays; ++i) {
      if (hits.triangle[static_cast<size_t>(i)] >= 0) {
        sum += radiance(hits, i, rays.direction(i));
      } else if (lights_.sky) {
        sum += lights_.sky(rays.direction(i).normalized());
      }
    }
  }
  return sum / static_cast<float>(points.size());
}

std::pair<Color, float> Gatherer::from_area(const AreaLight& light, const Mesh::Surface& surface, uint32_t seed) const {
  RayTracer::Rays rays;
  rays.origin = surface.position + kSurfaceOffset * surface.normal;
  const Eigen::Matrix2f turn = light.is_ball() ? random_turn(seed) : Eigen::Matrix2f::Identity();
  std::array<float, RayTracer::kRays> weights{};
  bool any = false;
  for (int i = 0; i < RayTracer::kRays; ++i) {
    const Vec2f ab = light.is_ball() ? Vec2f(turn * disc_[static_cast<size_t>(i)]) : on_square(i, seed);
    const Vec3f to = light.point(ab.x(), ab.y(), surface.position) - rays.origin;
    const float distance2 = to.squaredNorm(), distance = std::sqrt(distance2);
    const float cosine = surface.normal.dot(to) / distance;
    const float cosine_light = light.is_ball() ? 1.0f : -light.normal.dot(to) / distance;
    if (cosine <= 0 || cosine_light <= 0) {
      rays.skip(i);
      continue;
    }
    // A ball looks like a disc of its radius at its centre.
    const float away2 = light.is_ball() ? (light.center - rays.origin).squaredNorm() : distance2;
    weights[static_cast<size_t>(i)] = cosine * cosine_light / std::max(away2, 0.01f);
    rays.set(i, to, 0.999f);
    any = true;
  }
  if (!any) return {Color::Zero(), 0.0f};
  const uint32_t blocked = tracer_.blocked(rays);
  float sum = 0, open = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] > 0 && !(blocked >> i & 1)) {
      sum += weights[i];
      open += 1;
    }
  }
  const float share = 1.0f / RayTracer::kRays;
  return {light.radiance * (sum * share * light.area() / kPi), open * share};
}

Color Gatherer::from_sun(const Mesh::Surface& surface, uint32_t seed) const {
  const SunLight& sun = lights_.sun;
  const float cosine = surface.normal.dot(sun.towards);
  if (cosine <= 0) return Color::Zero();
  const auto [a, b] = orthogonal_axes(sun.towards);
  RayTracer::Rays rays;
  rays.origin = surface.position + kSurfaceOffset * surface.normal;
  const Eigen::Matrix2f turn = random_turn(seed);
  for (int i = 0; i < RayTracer::kRays; ++i) {
    const Vec2f d = sun.radius * (turn * disc_[static_cast<size_t>(i)]);
    rays.set(i, sun.towards + d.x() * a + d.y() * b);
  }
  const int open = RayTracer::kRays - std::popcount(tracer_.blocked(rays));
  return sun.irradiance * (cosine * static_cast<float>(open) / RayTracer::kRays / kPi);
}

}  // namespace photoslam::synthetic
