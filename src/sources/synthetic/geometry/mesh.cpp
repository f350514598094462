// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/geometry/mesh.h"

#include <algorithm>

namespace photoslam::synthetic {
namespace {

/// The interval of a rising sequence that holds x, and the place of x in it.
template <class Coordinate>
std::pair<int, float> locate(int count, float x, const Coordinate& coordinate) {
  int low = 0, high = count - 1;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (coordinate(middle) <= x ? low : high) = middle;
  }
  const float width = coordinate(high) - coordinate(low);
  return {low, width > 0 ? std::clamp((x - coordinate(low)) / width, 0.0f, 1.0f) : 0.0f};
}

}  // namespace

Mesh::Surface Mesh::surface(const Patch& patch, float u, float v) const {
  const auto vertex = [&](int column, int row) -> const Vertex& {
    return vertices[patch.first_vertex + static_cast<size_t>(row * patch.columns + column)];
  };
  const auto [column, a] = locate(patch.columns, u, [&](int i) { return vertex(i, 0).uv.x(); });
  const auto [row, b] = locate(patch.rows, v, [&](int i) { return vertex(0, i).uv.y(); });
  const Vertex &v00 = vertex(column, row), &v10 = vertex(column + 1, row);
  const Vertex &v01 = vertex(column, row + 1), &v11 = vertex(column + 1, row + 1);
  const auto blend = [a = a, b = b](const Vec3f& p00, const Vec3f& p10, const Vec3f& p01, const Vec3f& p11) -> Vec3f {
    return (p00 * (1 - a) + p10 * a) * (1 - b) + (p01 * (1 - a) + p11 * a) * b;
  };
  return {blend(v00.position, v10.position, v01.position, v11.position),
          blend(v00.normal, v10.normal, v01.normal, v11.normal).normalized()};
}

Mesh::Hit Mesh::hit(int32_t triangle, float second, float third) const {
  const Triangle& t = triangles[static_cast<size_t>(triangle)];
  const Vertex &a = vertices[t.vertices[0]], &b = vertices[t.vertices[1]], &c = vertices[t.vertices[2]];
  const float first = 1 - second - third;
  const Patch& patch = patches[t.patch];
  const Color tint =
      tints.empty()
          ? Color::Ones()
          : Color(first * tints[t.vertices[0]] + second * tints[t.vertices[1]] + third * tints[t.vertices[2]]);
  return {patch, materials[static_cast<size_t>(patch.material)], first * a.uv + second * b.uv + third * c.uv,
          (first * a.normal + second * b.normal + third * c.normal).normalized(), tint};
}

}  // namespace photoslam::synthetic
