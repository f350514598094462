// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/world.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/check.h"
#include "sources/synthetic/furniture/workshop.h"
#include "sources/synthetic/lighting/light_map.h"

namespace photoslam {

using synthetic::Color;
using synthetic::RayTracer;
using synthetic::Triangle;
using synthetic::Vec2f;
using synthetic::Vec3f;

namespace {

constexpr float kExposure = 1.5f;  // radiance of the image per radiance in the room
constexpr int kSamples = CameraRays::kSamples;

/// A camera at a place; the parameter of its rays is the depth (z coordinate).
struct Eye {
  Vec3 origin;
  Mat3 world_from_camera;
  const CameraRays& rays;

  Eye(const SE3& pose, const CameraRays& r) : origin(pose.translation), world_from_camera(pose.matrix3()), rays(r) {}
  Vec3 direction(int x, int y, int sample) const { return world_from_camera * rays.ray(x, y, sample); }
};

/// Schlick's approximation of the Fresnel reflectance.
float fresnel(float at_normal, float cosine) {
  const float m = 1 - cosine, m2 = m * m;
  return at_normal + (1 - at_normal) * m2 * m2 * m;
}

/// What lens and colour filter do to a sharp image: every pixel gives a little of its light to its neighbours.
ImageF soften(const ImageF& sharp, Executor& executor) {
  constexpr float kShare = 0.12f;  // for each neighbour along a row or column
  const int width = sharp.width(), height = sharp.height();
  ImageF soft(width, height, 3);
  executor.for_each(height, [&](int y, int) {
    const float* row = sharp.row(y);
    const float* above = sharp.row(std::max(y - 1, 0));
    const float* below = sharp.row(std::min(y + 1, height - 1));
    std::vector<float> column(static_cast<size_t>(3 * width));
    for (int i = 0; i < 3 * width; ++i) {
      column[static_cast<size_t>(i)] = (1 - 2 * kShare) * row[i] + kShare * (above[i] + below[i]);
    }
    for (int i = 0; i < 3 * width; ++i) {
      const size_t left = static_cast<size_t>(i < 3 ? i : i - 3),
                   right = static_cast<size_t>(i + 3 < 3 * width ? i + 3 : i);
      soft.row(y)[i] = (1 - 2 * kShare) * column[static_cast<size_t>(i)] + kShare * (column[left] + column[right]);
    }
  });
  return soft;
}

}  // namespace

struct SyntheticWorld::State {
  synthetic::SceneModel model;
  RayTracer tracer;
  synthetic::LightMap light;

  State(synthetic::SceneModel m, SceneQuality quality, Executor& executor)
      : model(std::move(m)),
        tracer(model.mesh),
        light(model.mesh, model.textures, tracer, model.lights, quality == SceneQuality::full ? 2 : 1, executor) {}

  void render_colors(const Shot& shot, int y, SceneView& view) const;
  void measure_geometry(const Eye& eye, int y, SceneView& view) const;
  Color shade(const RayTracer::Hits& hits, int ray, const Vec3f& origin, const Vec3f& direction, float focal,
              float reflections) const;
  Color mirrored_light(const Vec3f& position, const Vec3f& reflected, float roughness, float visible) const;
  Color outside(const Vec3f& origin, const Vec3f& direction) const;
};

/// What a ray sees that hits nothing: the sky, or what is behind the window, at a distance where no furniture is.
Color SyntheticWorld::State::outside(const Vec3f& origin, const Vec3f& direction) const {
  if (model.lights.sky) return model.lights.sky(direction.normalized());
  if (direction.x() <= 1e-6f) return Color::Zero();
  const float t = (model.backdrop_corner.x() - origin.x()) / direction.x();
  const Vec3f offset = origin + t * direction - model.backdrop_corner;
  const float x = offset.dot(model.backdrop_right.normalized()), y = offset.dot(model.backdrop_down.normalized());
  return 2.2f * model.backdrop.sample(x, y, 0.03f);
}

/// The window as seen in a glossy surface: sharp when smooth, wide and faint when rough.
Color SyntheticWorld::State::mirrored_light(const Vec3f& position, const Vec3f& reflected, float roughness,
                                            float visible) const {
  if (model.lights.areas.empty() || model.lights.areas.front().is_ball()) return Color::Zero();
  const synthetic::AreaLight& window = model.lights.areas.front();
  const float towards = -reflected.dot(window.normal);
  if (towards <= 0.02f || visible <= 0) return Color::Zero();
  const float t = (position - window.center).dot(window.normal) / towards;
  if (t <= 0) return Color::Zero();
  const Vec3f at = position + t * reflected - window.center;
  const float blur = roughness * t;
  const auto coverage = [blur](float offset, float half) {
    const float a = std::clamp((half - offset) / (2 * blur) + 0.5f, 0.0f, 1.0f);
    const float b = std::clamp((half + offset) / (2 * blur) + 0.5f, 0.0f, 1.0f);
    return a * a * (3 - 2 * a) + b * b * (3 - 2 * b) - 1;
  };
  const float half_u = window.half_u.norm(), half_v = window.half_v.norm();
  const float share =
      coverage(at.dot(window.half_u) / half_u, half_u) * coverage(at.dot(window.half_v) / half_v, half_v);
  return window.radiance * (std::max(share, 0.0f) * visible);
}

Color SyntheticWorld::State::shade(const RayTracer::Hits& hits, int ray, const Vec3f& origin, const Vec3f& direction,
                                   float focal, float reflections) const {
  const size_t k = static_cast<size_t>(ray);
  if (hits.triangle[k] < 0) return outside(origin, direction);
  const synthetic::Mesh::Hit hit = model.mesh.hit(hits.triangle[k], hits.u[k], hits.v[k]);
  const Vec3f view = -direction.normalized();
  Vec3f normal = hit.normal;
  float cosine = normal.dot(view);
  if (cosine < 0) {
    normal = -normal;
    cosine = -cosine;
  }
  cosine = std::max(cosine, 0.02f);

  // One of the samples stands for half a pixel across, and for a quarter of the pixel's length on a slanted surface.
  const float across = hits.distance[k] / focal;
  const float footprint = std::max(0.8f * across, std::min(0.4f * across / cosine, 2 * across));
  const Vec2f place = hit.patch.texture_place(hit.uv);
  const Color albedo = hit.tint * model.textures[static_cast<size_t>(hit.material.texture)].sample(
                                      place.x(), place.y(), footprint * hit.patch.texture_metres);
  if (model.baked) return albedo / kExposure;
  const Color incoming = light.sample(hit.patch, hit.uv);
  Color out = albedo * (incoming + hit.material.emission);
  const float gloss = hit.material.gloss * albedo[3];
  if (gloss > 0.004f && reflections > 0) {
    const Vec3f position = origin + hits.distance[k] * direction;
    const Vec3f reflected = 2 * normal.dot(view) * normal - view;
    const float reflectance = reflections * fresnel(gloss, cosine) * (1 - hit.material.roughness);
    // Apart from the window, a surface mirrors about as much light as falls on it.
    out += reflectance * (0.8f * incoming + mirrored_light(position, reflected, hit.material.roughness, incoming[3]));
  }
  return out;
}

void SyntheticWorld::State::render_colors(const Shot& shot, int y, SceneView& view) const {
  const PinholeCamera& camera = shot.rays.camera();
  const float focal = static_cast<float>(std::min(camera.fx, camera.fy));
  // In motion, every sample of a pixel has its own moment of the exposure.
  const int passes = shot.moves_in_exposure ? 4 * kSamples : 1, samples = shot.moves_in_exposure ? 1 : kSamples;
  const int pixels = RayTracer::kRays / samples;
  std::vector<Color> sums(static_cast<size_t>(camera.width), Color::Zero());
  RayTracer::Rays rays;
  RayTracer::Hits hits;
  for (int pass = 0; pass < passes; ++pass) {
    const Eye eye(shot.world_from_camera(y, (pass + 0.5) / passes), shot.rays);
    rays.origin = eye.origin.cast<float>();
    for (int x0 = 0; x0 < camera.width; x0 += pixels) {
      for (int i = 0; i < RayTracer::kRays; ++i) {
        const int x = x0 + i / samples, sample = (pass + i % samples) % kSamples;
        rays.set_or_skip(i, x < camera.width ? eye.direction(x, y, sample) : Vec3::Zero());
      }
      tracer.intersect(rays, hits);
      for (int i = 0; i < RayTracer::kRays; ++i) {
        if (!rays.exists(i)) continue;
        // Lights do not bleed over the edges of what stands before them.
        sums[static_cast<size_t>(x0 + i / samples)] +=
            shade(hits, i, rays.origin, rays.direction(i), focal, shot.reflections).min(3.0f / kExposure);
      }
    }
  }
  const float scale = kExposure / static_cast<float>(passes * samples);
  for (int x = 0; x < camera.width; ++x) {
    for (int c = 0; c < 3; ++c) view.radiance(x, y, c) = sums[static_cast<size_t>(x)][c] * scale;
  }
}

void SyntheticWorld::State::measure_geometry(const Eye& eye, int y, SceneView& view) const {
  RayTracer::Rays rays;
  RayTracer::Hits hits;
  rays.origin = eye.origin.cast<float>();
  for (int x0 = 0; x0 < view.depth.width(); x0 += RayTracer::kRays) {
    const int count = std::min(RayTracer::kRays, view.depth.width() - x0);
    for (int i = 0; i < RayTracer::kRays; ++i) {
      rays.set_or_skip(i, i < count ? eye.direction(x0 + i, y, CameraRays::kCentre) : Vec3::Zero());
    }
    tracer.intersect(rays, hits);
    for (int i = 0; i < count; ++i) {
      if (!rays.exists(i)) continue;
      const Vec3 direction = eye.direction(x0 + i, y, CameraRays::kCentre);
      const int32_t id = hits.triangle[static_cast<size_t>(i)];
      double depth = 0, cosine = 1;
      if (id >= 0) {
        // The ray tracer tells which triangle; its plane is intersected in double precision.
        const auto corner = [&](size_t k) -> Vec3 {
          const Triangle& triangle = model.mesh.triangles[static_cast<size_t>(id)];
          return model.mesh.vertices[triangle.vertices[k]].position.cast<double>();
        };
        const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
        depth = normal.dot(corner(0) - eye.origin) / normal.dot(direction);
        cosine = std::abs(normal.normalized().dot(direction.normalized()));
      } else if (!model.lights.sky && direction.x() > 1e-6) {
        depth = (model.backdrop_corner.x() - eye.origin.x()) / direction.x();
        cosine = std::abs(direction.normalized().x());
      }
      view.depth(x0 + i, y) = static_cast<float>(depth);
      view.incidence(x0 + i, y) = static_cast<float>(cosine);
    }
  }
}

SyntheticWorld::SyntheticWorld(synthetic::SceneModel model, SceneQuality quality, Executor& executor)
    : state_(std::make_unique<const State>(std::move(model), quality, executor)) {}
SyntheticWorld::~SyntheticWorld() = default;

SceneView SyntheticWorld::render(const SE3& world_from_camera, const PinholeCamera& camera, Executor& executor) const {
  const CameraRays rays(camera);
  return render({rays, [&](int, double) { return world_from_camera; }}, executor);
}

SceneView SyntheticWorld::render(const Shot& shot, Executor& executor) const {
  const PinholeCamera& camera = shot.rays.camera();
  SceneView view;
  view.radiance = ImageF(camera.width, camera.height, 3);
  view.depth = ImageF(camera.width, camera.height);
  view.incidence = ImageF(camera.width, camera.height);
  executor.for_each(camera.height, [&](int y, int) {
    state_->render_colors(shot, y, view);
    state_->measure_geometry(Eye(shot.world_from_camera(y, 0.5), shot.rays), y, view);
  });
  view.radiance = soften(view.radiance, executor);
  return view;
}

}  // namespace photoslam
