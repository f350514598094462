// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "sources/synthetic/textures/color.h"

namespace photoslam::synthetic {

using Vec3f = Eigen::Vector3f;
using Vec2f = Eigen::Vector2f;

/// How a surface reflects light, apart from its texture.
struct Material {
  int texture = 0;
  float gloss = 0.04f;      ///< Mirror reflectance at normal incidence.
  float roughness = 0.25f;  ///< Blur of mirrored lights [rad].
  float emission = 0;       ///< Radiance given off, times the texture's colour.
  float translucency = 0;   ///< Share of the diffuse light that comes through from the other side.
};

struct Vertex {
  Vec3f position;
  Vec3f normal;
  Vec2f uv;  ///< Place in its patch, in [0, 1]².
};

/// A grid of triangles with one material, one texture mapping and one light map.
///
/// Seen from outside, u runs to the right and v down.
struct Patch {
  int material = 0;
  bool swap_uv = false;                   ///< Texture x along v instead of u.
  Vec2f texture_origin{0, 0};             ///< Texture place of (u, v) = (0, 0) [m].
  Vec2f texture_size{1, 1};               ///< Texture extent of the patch [m].
  float texture_metres = 1;               ///< Texture metres per metre in space.
  int light_width = 2, light_height = 2;  ///< Light map nodes, the outermost ones on the patch's edge.
  size_t light_offset = 0;                ///< Index of the first node among those of all patches.
  int columns = 2, rows = 2;              ///< Grid of vertices.
  size_t first_vertex = 0;

  /// Place in the texture [m] of (u, v).
  Vec2f texture_place(const Vec2f& uv) const {
    return texture_origin + (swap_uv ? Vec2f(uv.y(), uv.x()) : uv).cwiseProduct(texture_size);
  }
};

struct Triangle {
  std::array<uint32_t, 3> vertices;
  uint32_t patch;
};

struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<Color> tints;  ///< Linear colour per vertex that multiplies the texture; empty: white.
  std::vector<Triangle> triangles;
  std::vector<Patch> patches;
  std::vector<Material> materials;
  size_t light_nodes = 0;

  struct Surface {
    Vec3f position;
    Vec3f normal;
  };
  /// The point (u, v) of a patch, bilinear between its vertices.
  Surface surface(const Patch& patch, float u, float v) const;

  /// What a ray has hit.
  struct Hit {
    const Patch& patch;
    const Material& material;
    Vec2f uv;
    Vec3f normal;  ///< Of unit length, pointing outwards.
    Color tint;    ///< Multiplies the texture.
  };
  /// The point of a triangle with the given weights of its second and third vertex.
  Hit hit(int32_t triangle, float second, float third) const;
};

}  // namespace photoslam::synthetic
