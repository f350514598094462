// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/geometry/shapes.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "sources/synthetic/geometry/ray_tracer.h"

namespace photoslam::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;

Mesh build(const std::function<void(MeshBuilder&, const Cover&)>& shape) {
  MeshBuilder builder(1);
  const Cover cover(builder.add_material({}, Vec2f(1, 1)));
  shape(builder, cover);
  return std::move(builder).finish();
}

/// Volume by the divergence theorem: right only when the surface is closed and every triangle faces outwards.
double volume(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t.vertices[0]].position.cast<double>(),
               b = mesh.vertices[t.vertices[1]].position.cast<double>(),
               c = mesh.vertices[t.vertices[2]].position.cast<double>();
    sum += a.dot(b.cross(c)) / 6;
  }
  return sum;
}

/// Every vertex normal is a unit vector on the outer side of the triangles around it.
void expect_outward_normals(const Mesh& mesh) {
  for (const Triangle& t : mesh.triangles) {
    const Vec3f a = mesh.vertices[t.vertices[0]].position;
    const Vec3f normal = (mesh.vertices[t.vertices[1]].position - a).cross(mesh.vertices[t.vertices[2]].position - a);
    for (const uint32_t v : t.vertices) {
      EXPECT_NEAR(mesh.vertices[v].normal.norm(), 1, 1e-5f);
      if (normal.norm() > 1e-7f) {
        EXPECT_GT(mesh.vertices[v].normal.dot(normal.normalized()), 0.0f);
      }
    }
  }
}

TEST(Shapes, HaveTheVolumesOfTheirSolids) {
  const SE3 frame = place(0.3, -0.2, 0.5, 33);
  const Mesh box =
      build([&](MeshBuilder& b, const Cover& c) { b.box(frame, Vec3(-1, 0, 2), Vec3(1, 2, 3), BoxCovers(c)); });
  EXPECT_NEAR(volume(box), 6, 1e-5);
  const Mesh cylinder = build([&](MeshBuilder& b, const Cover& c) { b.cylinder(frame, 0.5, 2, c, 200); });
  EXPECT_NEAR(volume(cylinder), kPi * 0.25 * 2, 1e-3);
  const Mesh sphere = build([&](MeshBuilder& b, const Cover& c) { b.sphere(frame, 0.7, c, 100); });
  EXPECT_NEAR(volume(sphere), 4.0 / 3 * kPi * 0.343, 4e-3);
  const Mesh rounded = build([&](MeshBuilder& b, const Cover& c) { b.rounded_box(frame, Vec3(1, 1, 1), 0.5, 0, c); });
  EXPECT_NEAR(volume(rounded), kPi / 6, 0.02);  // a ball
  for (const Mesh* mesh : {&box, &cylinder, &sphere, &rounded}) expect_outward_normals(*mesh);
}

TEST(Shapes, CurvedNormalsAreThoseOfTheSurface) {
  const Mesh sphere = build([](MeshBuilder& b, const Cover& c) { b.sphere(SE3(), 2, c, 60); });
  for (const Vertex& vertex : sphere.vertices) EXPECT_LT((vertex.normal - vertex.position / 2).norm(), 0.03f);
}

TEST(Shapes, TexturesLieTrueToScale) {
  const Mesh mesh = build(
      [](MeshBuilder& b, const Cover& c) { b.rectangle(SE3(), Vec3(0, 0, 0), Vec3(0.2, 0, 0), Vec3(0, 0, -0.7), c); });
  // The longer side lies along the texture's x axis.
  const Patch& patch = mesh.patches[0];
  EXPECT_NEAR((patch.texture_place(Vec2f(0, 1)) - patch.texture_place(Vec2f(0, 0))).x(), 0.7f, 1e-6f);
  EXPECT_NEAR((patch.texture_place(Vec2f(1, 0)) - patch.texture_place(Vec2f(0, 0))).y(), 0.2f, 1e-6f);
}

TEST(RayTracer, HitsASphereWhereTheFormulaSays) {
  const Mesh mesh = build([](MeshBuilder& b, const Cover& c) { b.sphere(place(0, 5, 0), 1, c, 400); });
  const RayTracer tracer(mesh);
  RayTracer::Rays rays;
  for (int i = 0; i < RayTracer::kRays; ++i) rays.set(i, Vec3f(0.03f * static_cast<float>(i), 1, 0.01f));
  rays.skip(3);
  RayTracer::Hits hits;
  tracer.intersect(rays, hits);
  const uint32_t blocked = tracer.blocked(rays);
  for (int i = 0; i < RayTracer::kRays; ++i) {
    // |t d − c| = 1 with c = (0, 5, 0).
    const Vec3 d = rays.direction(i).cast<double>();
    const double half = 5 * d.y(), discriminant = half * half - d.squaredNorm() * 24;
    const bool expected = i != 3 && discriminant > 0;
    const size_t k = static_cast<size_t>(i);
    EXPECT_EQ(hits.triangle[k] >= 0, expected) << i;
    EXPECT_EQ((blocked >> i & 1) != 0, expected) << i;
    if (!expected) continue;
    EXPECT_NEAR(hits.distance[k], (half - std::sqrt(discriminant)) / d.squaredNorm(), 2e-3) << i;
    const Vec3f at = hits.distance[k] * rays.direction(i);
    EXPECT_GT(mesh.hit(hits.triangle[k], hits.u[k], hits.v[k]).normal.dot(at - Vec3f(0, 5, 0)), 0.999f) << i;
  }
}

}  // namespace
}  // namespace photoslam::synthetic
