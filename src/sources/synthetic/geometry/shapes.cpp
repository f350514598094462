// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/geometry/shapes.h"

#include <cmath>
#include <numbers>
#include <numeric>

#include "base/check.h"

namespace photoslam::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;

/// Direction of a grid line at a vertex from its neighbours; a neighbour at the same place does not count.
Vec3 direction(const Vec3& before, const Vec3& here, const Vec3& after) {
  const Vec3 a = here - before, b = after - here;
  Vec3 sum = Vec3::Zero();
  if (a.norm() > 1e-9) sum += a.normalized();
  if (b.norm() > 1e-9) sum += b.normalized();
  return sum;
}

/// Normals of a grid from its points; grids whose first and last columns coincide are closed.
std::vector<Vec3> grid_normals(int columns, int rows, const std::vector<Vec3>& points) {
  const auto at = [&](int c, int r) -> const Vec3& { return points[static_cast<size_t>(r * columns + c)]; };
  const bool closed = (at(0, rows / 2) - at(columns - 1, rows / 2)).norm() < 1e-9;
  const auto along_u = [&](int c, int r) {
    const int before = c > 0 ? c - 1 : (closed ? columns - 2 : 0);
    const int after = c + 1 < columns ? c + 1 : (closed ? 1 : c);
    return direction(at(before, r), at(c, r), at(after, r));
  };
  std::vector<Vec3> normals;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      Vec3 du = along_u(c, r);
      if (du.norm() < 1e-9) du = along_u(c, r > 0 ? r - 1 : r + 1);  // a pole
      const Vec3 dv = direction(at(c, std::max(r - 1, 0)), at(c, r), at(c, std::min(r + 1, rows - 1)));
      const Vec3 normal = dv.cross(du);
      normals.push_back(normal.norm() > 1e-9 ? Vec3(normal.normalized()) : Vec3::UnitZ());
    }
    // All points of a pole share one normal.
    const auto row = normals.end() - columns;
    if ((at(0, r) - at(columns / 2, r)).norm() < 1e-9) {
      const Vec3 mean = std::accumulate(row, normals.end(), Vec3(Vec3::Zero())).normalized();
      std::fill(row, normals.end(), mean);
    }
  }
  return normals;
}

/// Mean distance along the grid from the first line to each line, in one direction.
template <class Point>
std::vector<double> arc_lengths(int lines, int across, const Point& point) {
  std::vector<double> lengths{0.0};
  for (int i = 1; i < lines; ++i) {
    double sum = 0;
    for (int j = 0; j < across; ++j) sum += (point(i, j) - point(i - 1, j)).norm();
    lengths.push_back(lengths.back() + sum / across);
  }
  return lengths;
}

int light_nodes(double length, double spacing) {
  return std::max(2, 1 + static_cast<int>(std::lround(length / spacing)));
}

}  // namespace

SE3 place(double x, double y, double z, double yaw_deg) {
  return {so3_exp(Vec3(0, 0, yaw_deg * kPi / 180)), Vec3(x, y, z)};
}

int MeshBuilder::add_material(const Material& material, const Vec2f& texture_size) {
  mesh_.materials.push_back(material);
  texture_sizes_.push_back(texture_size);
  return static_cast<int>(mesh_.materials.size()) - 1;
}

void MeshBuilder::patch(const SE3& world_from_object, int columns, int rows, const Surface& surface,
                        const Cover& cover) {
  PHOTOSLAM_CHECK(columns >= 2 && rows >= 2, "{} x {}", columns, rows);
  std::vector<Vec3> points;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      points.push_back(world_from_object *
                       surface(static_cast<double>(c) / (columns - 1), static_cast<double>(r) / (rows - 1)));
    }
  }
  const auto at = [&](int c, int r) -> const Vec3& { return points[static_cast<size_t>(r * columns + c)]; };
  const std::vector<Vec3> normals = grid_normals(columns, rows, points);
  const std::vector<double> us = arc_lengths(columns, rows, [&](int i, int j) { return at(i, j); });
  const std::vector<double> vs = arc_lengths(rows, columns, [&](int i, int j) { return at(j, i); });

  Patch patch;
  patch.columns = columns;
  patch.rows = rows;
  patch.first_vertex = mesh_.vertices.size();
  patch.light_width = light_nodes(us.back(), light_coarseness_ * cover.light_spacing);
  patch.light_height = light_nodes(vs.back(), light_coarseness_ * cover.light_spacing);
  patch.light_offset = mesh_.light_nodes;
  mesh_.light_nodes += static_cast<size_t>(patch.light_width) * static_cast<size_t>(patch.light_height);
  map_texture(patch, Vec2(us.back(), vs.back()).cast<float>(), cover);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const size_t i = static_cast<size_t>(r * columns + c);
      const Vec2 uv(us[static_cast<size_t>(c)] / std::max(us.back(), 1e-9),
                    vs[static_cast<size_t>(r)] / std::max(vs.back(), 1e-9));
      mesh_.vertices.push_back({points[i].cast<float>(), normals[i].cast<float>(), uv.cast<float>()});
    }
  }
  const uint32_t id = static_cast<uint32_t>(mesh_.patches.size());
  mesh_.patches.push_back(patch);
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      const uint32_t a = static_cast<uint32_t>(patch.first_vertex) + static_cast<uint32_t>(r * columns + c);
      const uint32_t below = a + static_cast<uint32_t>(columns);
      mesh_.triangles.push_back({{a, below, a + 1}, id});
      mesh_.triangles.push_back({{a + 1, below, below + 1}, id});
    }
  }
}

void MeshBuilder::map_texture(Patch& patch, const Vec2f& size, const Cover& cover) {
  const Vec2f texture = texture_sizes_[static_cast<size_t>(cover.material)];
  patch.material = cover.material;
  if (cover.fit == Cover::Fit::stretch) {
    patch.texture_size = texture;
    patch.texture_metres = texture.x() / std::max(size.x(), 1e-6f);
    return;
  }
  patch.swap_uv = cover.fit == Cover::Fit::random && size.y() > size.x();
  patch.texture_size = patch.swap_uv ? Vec2f(size.y(), size.x()) : size;
  for (int i = 0; i < 2; ++i) {
    const double room = std::max(0.0f, texture[i] - patch.texture_size[i]);
    patch.texture_origin[i] = static_cast<float>(random_.uniform(0, room));
  }
}

void MeshBuilder::rectangle(const SE3& frame, const Vec3& corner, const Vec3& right, const Vec3& down,
                            const Cover& cover) {
  patch(frame, 2, 2, [&](double u, double v) -> Vec3 { return corner + u * right + v * down; }, cover);
}

void MeshBuilder::box(const SE3& frame, const Vec3& corner, const Vec3& size, const BoxCovers& covers) {
  const Vec3 x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
  rectangle(frame, corner + z, x, -z, covers.front);
  rectangle(frame, corner + x + y + z, -x, -z, covers.back);
  rectangle(frame, corner + x + z, y, -z, covers.right);
  rectangle(frame, corner + y + z, -y, -z, covers.left);
  rectangle(frame, corner + y + z, x, -y, covers.top);
  rectangle(frame, corner, x, y, covers.bottom);
}

void MeshBuilder::lathe(const SE3& frame, std::span<const Vec2> profile, const Cover& cover, int segments) {
  const int rows = static_cast<int>(profile.size());
  const auto surface = [&](double u, double v) -> Vec3 {
    const Vec2& p = profile[static_cast<size_t>(std::lround(v * (rows - 1)))];
    const double angle = u >= 1 ? -kPi : 2 * kPi * (u - 0.5);
    return {p.x() * std::sin(angle), -p.x() * std::cos(angle), p.y()};
  };
  patch(frame, segments + 1, rows, surface, cover);
}

void MeshBuilder::cylinder(const SE3& frame, double radius, double height, const Cover& cover, int segments) {
  const Vec2 side[] = {{radius, height}, {radius, 0}};
  const Vec2 top[] = {{0, height}, {radius, height}};
  const Vec2 bottom[] = {{radius, 0}, {0, 0}};
  lathe(frame, side, cover, segments);
  lathe(frame, top, cover, segments);
  lathe(frame, bottom, cover, segments);
}

void MeshBuilder::sphere(const SE3& frame, double radius, const Cover& cover, int segments) {
  std::vector<Vec2> profile;
  for (int i = 0; i <= segments / 2; ++i) {
    const double angle = 2 * kPi * i / segments;
    profile.push_back({radius * std::sin(angle), radius * std::cos(angle)});
  }
  lathe(frame, profile, cover, segments);
}

void MeshBuilder::rounded_box(const SE3& frame, const Vec3& size, double radius, double bulge, const Cover& cover) {
  // Each face is a grid of the unit cube's face, denser at the edges, pulled onto the rounded box.
  constexpr int kPoints = 13;
  const Vec3 half = size / 2;
  const Vec3 core = (half.array() - radius).max(0.0);
  const auto face = [&](const Vec3& out, const Vec3& right, const Vec3& down) {
    const auto surface = [&](double u, double v) -> Vec3 {
      const double a = std::sin(kPi * (u - 0.5)), b = std::sin(kPi * (v - 0.5));
      const Vec3 cube = (out + a * right + b * down).cwiseProduct(half);
      const Vec3 inner = cube.cwiseMax(-core).cwiseMin(core);
      const Vec3 outward = cube - inner;
      const Vec3 rounded = outward.norm() > 1e-9 ? Vec3(inner + radius * outward.normalized()) : inner;
      return rounded + bulge * (1 - a * a) * (1 - b * b) * out;
    };
    patch(frame, kPoints, kPoints, surface, cover);
  };
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  face(-y, x, -z);
  face(y, -x, -z);
  face(x, y, -z);
  face(-x, -y, -z);
  face(z, x, -y);
  face(-z, x, y);
}

void MeshBuilder::pillow(const SE3& frame, const Vec3& size, const Cover& cover) {
  constexpr int kPoints = 17;
  for (const double side : {-1.0, 1.0}) {
    const auto surface = [&](double u, double v) -> Vec3 {
      const double a = side < 0 ? 2 * u - 1 : 1 - 2 * u, b = 1 - 2 * v;
      const double thickness = std::pow((1 - a * a) * (1 - b * b), 0.45);
      // The filling pulls the middle of the seams inwards.
      const double pull_a = 1 - 0.07 * (1 - b * b), pull_b = 1 - 0.07 * (1 - a * a);
      return {size.x() / 2 * a * pull_a, side * size.y() / 2 * thickness, size.z() / 2 * b * pull_b};
    };
    patch(frame, kPoints, kPoints, surface, cover);
  }
}

void MeshBuilder::tube(const SE3& frame, std::span<const Vec3> path, double radius, const Cover& cover, int segments) {
  PHOTOSLAM_CHECK(path.size() >= 2, "{} points", path.size());
  const int rows = static_cast<int>(path.size());
  const auto surface = [&](double u, double v) -> Vec3 {
    const int i = static_cast<int>(std::lround(v * (rows - 1)));
    const Vec3& here = path[static_cast<size_t>(i)];
    const Vec3 along =
        path[static_cast<size_t>(std::min(i + 1, rows - 1))] - path[static_cast<size_t>(std::max(i - 1, 0))];
    const Vec3 down = along.normalized();
    const Vec3 side = down.cross(std::abs(down.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitY()).normalized();
    const double angle = u >= 1 ? 0 : 2 * kPi * u;
    return here + radius * (std::cos(angle) * side + std::sin(angle) * side.cross(down));
  };
  patch(frame, segments + 1, rows, surface, cover);
}

void MeshBuilder::leaf(const SE3& frame, const Vec3& along, double width, double droop, const Cover& cover) {
  const Vec3 side = along.cross(Vec3::UnitZ()).normalized() * width / 2;
  const auto surface = [&](double u, double v) -> Vec3 {
    const double a = 2 * u - 1;
    const double shape = std::pow(std::sin(kPi * std::pow(v, 0.75)), 0.8);
    const double fold = 0.25 * width * std::abs(a) * shape;
    return v * along + a * shape * side + Vec3(0, 0, fold - droop * v * v);
  };
  patch(frame, 5, 9, surface, cover);
}

}  // namespace photoslam::synthetic
