// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/lighting/light.h"

#include <algorithm>
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
constexpr int kBounceCoarseness = 3;       // light map nodes per node of the indirect light
static_assert(kSide * kSide == RayTracer::kRays);

/// Two axes orthogonal to a unit vector and to each other. Source: Duff et al., "Building an orthonormal basis,
/// revisited", 2017.
std::pair<Vec3f, Vec3f> orthogonal_axes(const Vec3f& n) {
  const float sign = std::copysign(1.0f, n.z());
  const float a = -1.0f / (sign + n.z()), b = n.x() * n.y() * a;
  return {Vec3f(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x()), Vec3f(b, sign + n.y() * n.y() * a, -n.y())};
}

/// Stratum i of the square [-1, 1]², shifted by a random amount that wraps around.
Vec2f on_square(int i, uint32_t seed) {
  const float x = (static_cast<float>(i % kSide) + 0.5f) / kSide + hash01(1, 0, seed);
  const float y = (static_cast<float>(i / kSide) + 0.5f) / kSide + hash01(2, 0, seed);
  return {2 * (x - std::floor(x)) - 1, 2 * (y - std::floor(y)) - 1};
}

/// count² points spread evenly over the unit disc. Source: Shirley and Chiu, "A low distortion map between disk and
/// square", 1997.
std::vector<Vec2f> disc_points(int count) {
  std::vector<Vec2f> points;
  for (int i = 0; i < count * count; ++i) {
    const float a = 2 * (static_cast<float>(i % count) + 0.5f) / static_cast<float>(count) - 1;
    const float b = 2 * (static_cast<float>(i / count) + 0.5f) / static_cast<float>(count) - 1;
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

/// Gathers the light that arrives at one point of a surface.
class Gatherer {
 public:
  Gatherer(const RayTracer& tracer, const Lights& lights)
      : tracer_(tracer), lights_(lights), disc_(disc_points(kSide)), hemisphere_(disc_points(kBounceSide)) {}

  /// Irradiance / π from the lights; the fourth value is the visible share of the first one.
  Color direct(const Mesh::Surface& surface, uint32_t seed) const {
    Color sum = Color::Zero();
    for (size_t i = 0; i < lights_.areas.size(); ++i) {
      const auto [light, visible] = from_area(lights_.areas[i], surface, seed + static_cast<uint32_t>(i));
      sum += light;
      if (i == 0) sum[3] = visible;
    }
    return sum + from_sun(surface, seed + 77);
  }

  /// Radiance from the hemisphere, averaged with cosine weights; `radiance(hits, ray, origin)` colours what is seen.
  template <class Radiance>
  Color indirect(const Mesh::Surface& surface, uint32_t seed, const Radiance& radiance) const {
    const auto [tangent, bitangent] = orthogonal_axes(surface.normal);
    RayTracer::Rays rays;
    RayTracer::Hits hits;
    rays.origin = surface.position + kSurfaceOffset * surface.normal;
    const Eigen::Matrix2f turn = random_turn(seed);
    Color sum = Color::Zero();
    constexpr int kTotal = kBounceSide * kBounceSide;
    for (int first = 0; first < kTotal; first += RayTracer::kRays) {
      for (int i = 0; i < RayTracer::kRays; ++i) {
        const Vec2f d = turn * hemisphere_[static_cast<size_t>(first + i)];
        const float up = std::sqrt(std::max(1e-4f, 1 - d.squaredNorm()));
        rays.set(i, d.x() * tangent + d.y() * bitangent + up * surface.normal);
      }
      tracer_.intersect(rays, hits);
      for (int i = 0; i < RayTracer::kRays; ++i) {
        if (hits.triangle[static_cast<size_t>(i)] >= 0) sum += radiance(hits, i, rays.direction(i));
      }
    }
    return sum / static_cast<float>(kTotal);
  }

 private:
  std::pair<Color, float> from_area(const AreaLight& light, const Mesh::Surface& surface, uint32_t seed) const {
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
      weights[static_cast<size_t>(i)] = cosine * cosine_light / std::max(distance2, 0.01f);
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

  Color from_sun(const Mesh::Surface& surface, uint32_t seed) const {
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

  const RayTracer& tracer_;
  const Lights& lights_;
  std::vector<Vec2f> disc_, hemisphere_;
};

/// Node (i, j) of a grid over the patch, kept a little away from the edges, where other surfaces touch.
Mesh::Surface node_surface(const Mesh& mesh, const Patch& patch, int i, int width, int j, int height) {
  const auto place = [](int k, int count) {
    const float step = 1.0f / static_cast<float>(count - 1);
    return std::clamp(static_cast<float>(k) * step, 0.12f * step, 1 - 0.12f * step);
  };
  return mesh.surface(patch, place(i, width), place(j, height));
}

Color bilinear(const Color* nodes, int width, int height, float u, float v) {
  const float x = std::clamp(u, 0.0f, 1.0f) * static_cast<float>(width - 1);
  const float y = std::clamp(v, 0.0f, 1.0f) * static_cast<float>(height - 1);
  const int ix = std::min(static_cast<int>(x), width - 2), iy = std::min(static_cast<int>(y), height - 2);
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
  const Color* n = nodes + iy * width + ix;
  return (n[0] * (1 - fx) + n[1] * fx) * (1 - fy) + (n[width] * (1 - fx) + n[width + 1] * fx) * fy;
}

/// Binomial 3x3 blur; takes the grain of the few hemisphere samples away.
void blur(std::vector<Color>& nodes, int width, int height) {
  const std::vector<Color> input = nodes;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Color sum = Color::Zero();
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int sx = std::clamp(x + dx, 0, width - 1), sy = std::clamp(y + dy, 0, height - 1);
          sum +=
              input[static_cast<size_t>(sy * width + sx)] * static_cast<float>((2 - std::abs(dx)) * (2 - std::abs(dy)));
        }
      }
      nodes[static_cast<size_t>(y * width + x)] = sum / 16.0f;
    }
  }
}

/// Calls gather(surface) at a point; thin materials get the mean of both sides.
template <class Gather>
Color both_sides(const Material& material, Mesh::Surface surface, const Gather& gather) {
  const Color front = gather(surface);
  if (material.translucency <= 0) return front;
  surface.normal = -surface.normal;
  return mix(front, gather(surface), material.translucency);
}

}  // namespace

float AreaLight::area() const { return is_ball() ? kPi * radius * radius : 4 * half_u.cross(half_v).norm(); }

Vec3f AreaLight::point(float a, float b, const Vec3f& seen_from) const {
  if (!is_ball()) return center + a * half_u + b * half_v;
  const Vec3f towards = (seen_from - center).normalized();
  const auto [x, y] = orthogonal_axes(towards);
  return center + radius * (1.05f * towards + a * x + b * y);
}

Color LightMap::sample(const std::vector<Color>& nodes, const Patch& patch, const Vec2f& uv) {
  return bilinear(nodes.data() + patch.light_offset, patch.light_width, patch.light_height, uv.x(), uv.y());
}

LightMap::LightMap(const Mesh& mesh, std::span<const Texture> textures, const RayTracer& tracer, const Lights& lights,
                   Executor& executor) {
  const Gatherer gatherer(tracer, lights);
  const int num_patches = static_cast<int>(mesh.patches.size());
  std::vector<Color> direct(mesh.light_nodes);
  executor.for_each(num_patches, [&](int p, int) {
    const Patch& patch = mesh.patches[static_cast<size_t>(p)];
    const Material& material = mesh.materials[static_cast<size_t>(patch.material)];
    for (int j = 0; j < patch.light_height; ++j) {
      for (int i = 0; i < patch.light_width; ++i) {
        const size_t node = patch.light_offset + static_cast<size_t>(j * patch.light_width + i);
        const uint32_t seed = hash(static_cast<int>(node), 0, 5);
        direct[node] = both_sides(material, node_surface(mesh, patch, i, patch.light_width, j, patch.light_height),
                                  [&](const Mesh::Surface& s) { return gatherer.direct(s, seed); });
      }
    }
  });

  nodes_ = direct;
  for (int bounce = 0; bounce < 2; ++bounce) {
    const auto radiance = [&](const RayTracer::Hits& hits, int ray, const Vec3f& towards) -> Color {
      const size_t k = static_cast<size_t>(ray);
      const Triangle& triangle = mesh.triangles[static_cast<size_t>(hits.triangle[k])];
      const Patch& patch = mesh.patches[triangle.patch];
      const Vertex &a = mesh.vertices[triangle.vertices[0]], &b = mesh.vertices[triangle.vertices[1]],
                   &c = mesh.vertices[triangle.vertices[2]];
      const Material& material = mesh.materials[static_cast<size_t>(patch.material)];
      // The dark inside of a closed object.
      if (material.translucency <= 0 && a.normal.dot(towards) > 0) return Color::Zero();
      const Vec2f uv = a.uv * (1 - hits.u[k] - hits.v[k]) + b.uv * hits.u[k] + c.uv * hits.v[k];
      const Vec2f place =
          patch.texture_origin + (patch.swap_uv ? Vec2f(uv.y(), uv.x()) : uv).cwiseProduct(patch.texture_size);
      const Color albedo = textures[static_cast<size_t>(material.texture)].sample(place.x(), place.y(), 0.05f);
      return albedo * sample(nodes_, patch, uv);
    };
    std::vector<Color> total(mesh.light_nodes);
    executor.for_each(num_patches, [&](int p, int) {
      const Patch& patch = mesh.patches[static_cast<size_t>(p)];
      const Material& material = mesh.materials[static_cast<size_t>(patch.material)];
      const int width = std::max(2, patch.light_width / kBounceCoarseness);
      const int height = std::max(2, patch.light_height / kBounceCoarseness);
      std::vector<Color> coarse(static_cast<size_t>(width * height));
      for (int j = 0; j < height; ++j) {
        for (int i = 0; i < width; ++i) {
          const size_t node = static_cast<size_t>(j * width + i);
          const uint32_t seed = hash(static_cast<int>(patch.light_offset + node), bounce, 9);
          coarse[node] = both_sides(material, node_surface(mesh, patch, i, width, j, height),
                                    [&](const Mesh::Surface& s) { return gatherer.indirect(s, seed, radiance); });
        }
      }
      if (width > 2 && height > 2) blur(coarse, width, height);
      for (int j = 0; j < patch.light_height; ++j) {
        for (int i = 0; i < patch.light_width; ++i) {
          const size_t node = patch.light_offset + static_cast<size_t>(j * patch.light_width + i);
          Color indirect =
              bilinear(coarse.data(), width, height, static_cast<float>(i) / static_cast<float>(patch.light_width - 1),
                       static_cast<float>(j) / static_cast<float>(patch.light_height - 1));
          indirect[3] = 0;
          total[node] = direct[node] + indirect;
        }
      }
    });
    nodes_ = std::move(total);
  }
}

}  // namespace photoslam::synthetic
