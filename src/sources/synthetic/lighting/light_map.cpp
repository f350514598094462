// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/lighting/light_map.h"

#include <algorithm>
#include <cmath>

#include "sources/synthetic/textures/noise.h"

namespace photoslam::synthetic {
namespace {

constexpr int kBounceCoarseness = 3;  // light map nodes per node of the indirect light, along each axis

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
  Color front = gather(surface);
  if (material.translucency <= 0) return front;
  surface.normal = -surface.normal;
  return mix(front, gather(surface), material.translucency);
}

/// Indirect light on a coarse grid over a patch.
struct CoarseGrid {
  int width, height;
  std::vector<Color> nodes;

  explicit CoarseGrid(const Patch& patch)
      : width(std::max(2, patch.light_width / kBounceCoarseness)),
        height(std::max(2, patch.light_height / kBounceCoarseness)),
        nodes(static_cast<size_t>(width * height)) {}

  Color sample(float u, float v) const { return bilinear(nodes.data(), width, height, u, v); }
};

/// Calls visit(node, i, j) for every light map node of a patch.
template <class Visit>
void for_each_node(const Patch& patch, const Visit& visit) {
  for (int j = 0; j < patch.light_height; ++j) {
    for (int i = 0; i < patch.light_width; ++i) {
      visit(patch.light_offset + static_cast<size_t>(j * patch.light_width + i), i, j);
    }
  }
}

}  // namespace

LightMap::LightMap(const Mesh& mesh, std::span<const Texture> textures, const RayTracer& tracer, const Lights& lights,
                   int bounces, Executor& executor)
    : nodes_(mesh.light_nodes) {
  const Gatherer gatherer(tracer, lights);
  add_direct(mesh, gatherer, executor);
  const std::vector<Color> direct = nodes_;
  for (int i = 0; i < bounces; ++i) {
    const std::vector<Color> indirect = bounce(mesh, textures, gatherer, i, executor);
    for (size_t node = 0; node < nodes_.size(); ++node) nodes_[node] = direct[node] + indirect[node];
  }
}

Color LightMap::sample(const Patch& patch, const Vec2f& uv) const {
  return bilinear(nodes_.data() + patch.light_offset, patch.light_width, patch.light_height, uv.x(), uv.y());
}

void LightMap::add_direct(const Mesh& mesh, const Gatherer& gatherer, Executor& executor) {
  executor.for_each(static_cast<int>(mesh.patches.size()), [&](int p, int) {
    const Patch& patch = mesh.patches[static_cast<size_t>(p)];
    const Material& material = mesh.materials[static_cast<size_t>(patch.material)];
    for_each_node(patch, [&](size_t node, int i, int j) {
      const uint32_t seed = hash(static_cast<int>(node), 0, 5);
      nodes_[node] = both_sides(material, node_surface(mesh, patch, i, patch.light_width, j, patch.light_height),
                                [&](const Mesh::Surface& surface) { return gatherer.direct(surface, seed); });
    });
  });
}

std::vector<Color> LightMap::bounce(const Mesh& mesh, std::span<const Texture> textures, const Gatherer& gatherer,
                                    int index, Executor& executor) const {
  const auto radiance = [&](const RayTracer::Hits& hits, int ray, const Vec3f& direction) -> Color {
    const size_t k = static_cast<size_t>(ray);
    const Mesh::Hit hit = mesh.hit(hits.triangle[k], hits.u[k], hits.v[k]);
    // The dark inside of a closed object.
    if (hit.material.translucency <= 0 && hit.normal.dot(direction) > 0) return Color::Zero();
    constexpr float kFootprint = 0.05f;  // [m]
    const Vec2f place = hit.patch.texture_place(hit.uv);
    const Texture& texture = textures[static_cast<size_t>(hit.material.texture)];
    return texture.sample(place.x(), place.y(), kFootprint) * sample(hit.patch, hit.uv);
  };
  // Light of later bounces is dim and even.
  const Gatherer::Sampling sampling = index == 0 ? Gatherer::Sampling::fine : Gatherer::Sampling::coarse;
  std::vector<Color> indirect(mesh.light_nodes);
  executor.for_each(static_cast<int>(mesh.patches.size()), [&](int p, int) {
    const Patch& patch = mesh.patches[static_cast<size_t>(p)];
    const Material& material = mesh.materials[static_cast<size_t>(patch.material)];
    CoarseGrid grid(patch);
    for (int k = 0; k < grid.width * grid.height; ++k) {
      const uint32_t node_seed = hash(static_cast<int>(patch.light_offset) + k, index, 9);
      grid.nodes[static_cast<size_t>(k)] = both_sides(
          material, node_surface(mesh, patch, k % grid.width, grid.width, k / grid.width, grid.height),
          [&](const Mesh::Surface& surface) { return gatherer.indirect(surface, node_seed, sampling, radiance); });
    }
    if (grid.width > 2 && grid.height > 2) blur(grid.nodes, grid.width, grid.height);
    for_each_node(patch, [&](size_t node, int i, int j) {
      indirect[node] = grid.sample(static_cast<float>(i) / static_cast<float>(patch.light_width - 1),
                                   static_cast<float>(j) / static_cast<float>(patch.light_height - 1));
      indirect[node][3] = 0;
    });
  });
  return indirect;
}

}  // namespace photoslam::synthetic
