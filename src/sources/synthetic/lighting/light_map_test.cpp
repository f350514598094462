// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/lighting/light_map.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sources/synthetic/geometry/shapes.h"

namespace photoslam::synthetic {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// A small world of one grey material that reflects half of the light.
struct World {
  Mesh mesh;
  std::vector<Texture> textures;
  Lights lights;

  explicit World(const std::function<void(MeshBuilder&, const Cover&)>& shape) {
    MeshBuilder builder(1);
    shape(builder, Cover(builder.add_material({}, Vec2f(1, 1)), Cover::Fit::stretch, 0.1));
    mesh = std::move(builder).finish();
    SerialExecutor serial;
    const float half = std::sqrt(0.5f);
    textures.push_back(Texture::paint(1, 1, 4, [half](float, float) { return Color(half, half, half, 1); }, serial));
  }
  LightMap light(Executor& executor) const { return {mesh, textures, RayTracer(mesh), lights, 2, executor}; }
};

void floor_of_size(MeshBuilder& builder, const Cover& cover, double size) {
  builder.rectangle(SE3(), Vec3(-size / 2, size / 2, 0), Vec3(size, 0, 0), Vec3(0, -size, 0), cover);
}

TEST(LightMap, LampsObeyTheInverseSquareLaw) {
  World world([](MeshBuilder& b, const Cover& c) { floor_of_size(b, c, 4); });
  world.lights.areas.push_back({.center = Vec3f(0, 0, 1.5f), .radius = 0.1f, .radiance = Color(10, 20, 30, 0)});
  SerialExecutor serial;
  const LightMap light = world.light(serial);
  for (float x : {0.0f, 0.5f, 1.0f, 1.5f}) {
    // Irradiance L π r² cos θ / d²; the map holds it divided by π.
    const float d2 = x * x + 1.5f * 1.5f;
    const float expected = 10 * 0.01f * (1.5f / std::sqrt(d2)) / d2;
    const Color got = light.sample(world.mesh.patches[0], Vec2f(0.5f + x / 4, 0.5f));
    EXPECT_NEAR(got[0], expected, 0.02f * expected) << x;
    EXPECT_NEAR(got[1], 2 * expected, 0.04f * expected) << x;
    EXPECT_EQ(got[3], 1.0f);
  }
}

TEST(LightMap, ASmallRectangleShinesWithTwoCosines) {
  World world([](MeshBuilder& b, const Cover& c) { floor_of_size(b, c, 4); });
  world.lights.areas.push_back({.center = Vec3f(-2.5f, 0, 1),
                                .half_u = Vec3f(0, 0.05f, 0),
                                .half_v = Vec3f(0, 0, 0.05f),
                                .normal = Vec3f::UnitX(),
                                .radiance = Color(100, 100, 100, 0)});
  SerialExecutor serial;
  const LightMap light = world.light(serial);
  for (float x : {-1.0f, 0.0f, 1.0f}) {
    const float away = x + 2.5f, d2 = away * away + 1;
    const float expected = 100 * 0.01f * (away / std::sqrt(d2)) * (1 / std::sqrt(d2)) / d2 / kPi;
    EXPECT_NEAR(light.sample(world.mesh.patches[0], Vec2f(0.5f + x / 4, 0.5f))[0], expected, 0.02f * expected) << x;
  }
}

TEST(LightMap, SunCastsShadows) {
  World world([](MeshBuilder& b, const Cover& c) {
    floor_of_size(b, c, 4);
    b.box(SE3(), Vec3(-0.5, -0.5, 1), Vec3(1, 1, 0.1), BoxCovers(c));
  });
  world.lights.sun = {.towards = Vec3f(0.6f, 0, 0.8f), .radius = 0.01f, .irradiance = Color(2, 2, 2, 0)};
  SerialExecutor serial;
  const LightMap light = world.light(serial);
  const auto at = [&](float x, float y) {
    return light.sample(world.mesh.patches[0], Vec2f(0.5f + x / 4, 0.5f - y / 4))[0];
  };
  // The shadow of the slab lies 0.75 m to the west. Elsewhere hardly more than the sun's own light arrives.
  const float lit = 2 * 0.8f / kPi;
  EXPECT_NEAR(at(1.5f, 0), lit, 0.1f * lit);
  EXPECT_NEAR(at(-0.75f, 1.5f), lit, 0.1f * lit);
  EXPECT_LT(at(-0.75f, 0), 0.25f * lit);
}

TEST(LightMap, BouncesMultiplyLightInsideAClosedBox) {
  // The light inside of a closed grey box of reflectance ρ with uniform direct light E grows to E (1 + ρ + ρ²) in two
  // bounces. A ball lamp in the middle of a ball gives uniform light.
  World world([](MeshBuilder& b, const Cover& c) {
    // Inside out: the profile runs from bottom to top.
    std::vector<Vec2> profile;
    for (int i = 0; i <= 30; ++i) {
      const double angle = std::numbers::pi * i / 30;
      profile.push_back({std::sin(angle), -std::cos(angle)});
    }
    b.lathe(SE3(), profile, c, 60);
  });
  world.lights.areas.push_back({.center = Vec3f(0, 0, 0), .radius = 0.1f, .radiance = Color(100, 100, 100, 0)});
  SerialExecutor serial;
  ThreadPool pool(2);
  const LightMap light = world.light(serial), same = world.light(pool);
  for (float v : {0.25f, 0.5f, 0.7f}) {
    const Color got = light.sample(world.mesh.patches[0], Vec2f(0.3f, v));
    EXPECT_NEAR(got[0], 1 + 0.5f + 0.25f, 0.04f) << v;
    EXPECT_TRUE((got == same.sample(world.mesh.patches[0], Vec2f(0.3f, v))).all());
  }
}

}  // namespace
}  // namespace photoslam::synthetic
