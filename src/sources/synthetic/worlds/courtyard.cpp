// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "sources/synthetic/textures/noise.h"
#include "sources/synthetic/worlds/passage.h"
#include "sources/synthetic/worlds/worlds.h"

namespace photoslam::synthetic {
namespace {

constexpr double kLength = 22, kDepth = 17, kHeight = 6.5;

/// Clouds on a plane high above; hazy at the horizon.
Color sky(const Vec3f& direction, uint32_t seed) {
  const float up = std::max(direction.z(), 0.03f);
  const float x = direction.x() / up, y = direction.y() / up;
  const float cloud = smoothstep(-0.1f, 0.5f, fractal(0.6f * x, 0.6f * y, 5, seed));
  const Color blue = mix(Color(0.62f, 0.70f, 0.78f, 0), Color(0.22f, 0.38f, 0.66f, 0), std::sqrt(up));
  const Color clear = mix(blue, Color(0.85f, 0.86f, 0.88f, 0), cloud * smoothstep(0.03f, 0.25f, direction.z()));
  return clear;
}

void window(Workshop& w, const SE3& frame, double width, double height, int glass) {
  MeshBuilder& mesh = w.mesh();
  const BoxCovers timber(Cover(w.white, Cover::Fit::random, 0.08));
  const BoxCovers stone(Cover(w.clay, Cover::Fit::random, 0.08));
  mesh.rectangle(frame, Vec3(0, -0.012, height), Vec3(width, 0, 0), Vec3(0, 0, -height),
                 Cover(glass, Cover::Fit::random, 0.2));
  for (const double x : {0.0, width / 2 - 0.03, width - 0.06}) {
    mesh.box(frame, Vec3(x, -0.05, 0), Vec3(0.06, 0.05, height), timber);
  }
  for (const double z : {0.0, 0.62 * height, height - 0.06}) {
    mesh.box(frame, Vec3(0, -0.045, z), Vec3(width, 0.045, 0.06), timber);
  }
  mesh.box(frame, Vec3(-0.12, -0.16, -0.1), Vec3(width + 0.24, 0.16, 0.1), stone);
  mesh.box(frame, Vec3(-0.12, -0.06, height), Vec3(width + 0.24, 0.06, 0.16), stone);
}

/// A house front with windows in two rows, doors and a cornice.
void facade(Workshop& w, const Vec2& from, const Vec2& to, const std::vector<int>& walls, int glass) {
  const double length = (to - from).norm();
  long_wall(w, from, to, kHeight, walls);
  const int timbers[] = {w.oak, w.walnut, w.birch};
  for (double along = 1.0; along < length - 2; along += w.random().uniform(2.2, 3.1)) {
    const double width = w.random().uniform(0.9, 1.3);
    window(w, at_wall(from, to, along, 3.9), width, 1.5, glass);
    if (w.random().uniform() < 0.25) {
      door_leaf(w, at_wall(from, to, along, 0), timbers[w.random().next() % std::size(timbers)]);
    } else {
      window(w, at_wall(from, to, along, 1.0), width, 1.5, glass);
    }
  }
  BoxCovers cornice(Cover(w.clay, Cover::Fit::random, 0.15));
  w.mesh().box(at_wall(from, to, 0, kHeight - 0.25), Vec3(0, -0.3, 0), Vec3(length, 0.3, 0.25), cornice);
  for (double along = 0.8; along < length - 0.8; along += w.random().uniform(2.5, 4.0)) {
    potted_plant(w, at_wall(from, to, along, 0) * place(0, -0.45, 0), 0.42, 0.55, 16);
  }
}

void tree(Workshop& w, const SE3& frame, double height) {
  MeshBuilder& mesh = w.mesh();
  const Vec3 trunk[] = {{0, 0, 0}, {0.05, 0.02, 0.4 * height}, {-0.03, 0.04, 0.75 * height}};
  mesh.tube(frame, trunk, 0.13, Cover(w.walnut, Cover::Fit::random, 0.1), 12);
  Random& random = w.random();
  for (int branch = 0; branch < 22; ++branch) {
    const double turn = random.uniform(0, 2 * std::numbers::pi), reach = random.uniform(0.7, 1.5);
    const Vec3 root(0, 0, random.uniform(0.45, 0.75) * height);
    const Vec3 tip = root + Vec3(reach * std::cos(turn), reach * std::sin(turn), random.uniform(0.3, 1.2));
    const Vec3 wood[] = {root, 0.5 * (root + tip) + Vec3(0, 0, 0.1), tip};
    mesh.tube(frame, wood, 0.025, Cover(w.walnut, Cover::Fit::random, 0.2), 6);
    for (int i = 0; i < 16; ++i) {
      const Vec3 at = root + random.uniform(0.35, 1.05) * (tip - root);
      const Vec3 along(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.1, 0.25));
      mesh.leaf(frame * place(at.x(), at.y(), at.z()), along + Vec3(0.02, 0.02, 0.05), 0.13, 0.06,
                Cover(i % 2 == 0 ? w.leaf_dark : w.leaf_light, Cover::Fit::random, 0.2));
    }
  }
}

void bench(Workshop& w, const SE3& frame) {
  const BoxCovers timber(Cover(w.oak, Cover::Fit::random, 0.05));
  for (int i = 0; i < 4; ++i) w.mesh().box(frame, Vec3(0, 0.12 * i, 0.43), Vec3(1.8, 0.1, 0.04), timber);
  for (int i = 0; i < 3; ++i) w.mesh().box(frame, Vec3(0, 0.5, 0.52 + 0.14 * i), Vec3(1.8, 0.04, 0.11), timber);
  for (const double x : {0.15, 1.55}) {
    w.mesh().box(frame, Vec3(x, 0, 0), Vec3(0.1, 0.5, 0.43), BoxCovers(Cover(w.black, Cover::Fit::random, 0.08)));
  }
}

/// Towers behind the houses, far enough to have hardly any parallax.
void far_walls(Workshop& w, int wall, int glass) {
  const BoxCovers covers(Cover(wall, Cover::Fit::random, 0.5));
  const struct {
    double x, y, width, height;
  } towers[] = {{-28, 6, 7, 19}, {12, 46, 9, 22}, {52, 2, 8, 24}, {40, 38, 6, 17}, {4, -34, 10, 20}, {-20, -24, 6, 16}};
  for (const auto& t : towers) {
    w.mesh().box(place(t.x, t.y, 0), Vec3(0, 0, 0), Vec3(t.width, t.width, t.height), covers);
    for (double z = 8; z < t.height - 1.5; z += 2.4) {
      for (double at = 0.8; at < t.width - 1; at += 1.9) {
        const BoxCovers pane(Cover(glass, Cover::Fit::random, 0.5));
        w.mesh().box(place(t.x, t.y, 0), Vec3(at, -0.02, z), Vec3(0.9, t.width + 0.04, 1.3), pane);
        w.mesh().box(place(t.x, t.y, 0), Vec3(-0.02, at, z), Vec3(t.width + 0.04, 0.9, 1.3), pane);
      }
    }
  }
}

}  // namespace

SceneModel build_courtyard(uint64_t seed, SceneQuality quality, Executor& executor) {
  Workshop w(seed, quality);
  const int paving = w.material(7, 7, 200, brick_wall(w.seed()), {.gloss = 0.01f});
  const int glass = w.material(1.5f, 1.5f, 120, plaster(rgb(0x2B3640), w.seed()), {.gloss = 0.15f, .roughness = 0.05f});
  const std::vector<int> walls = {w.material(5, static_cast<float>(kHeight), 150, brick_wall(w.seed())),
                                  w.material(5, static_cast<float>(kHeight), 150, plaster(rgb(0xCDB58C), w.seed())),
                                  w.material(5, static_cast<float>(kHeight), 150, plaster(rgb(0xB79C8E), w.seed()))};
  constexpr int kTiles = 4;
  for (int i = 0; i < kTiles; ++i) {
    for (int j = 0; j < kTiles; ++j) {
      const double dx = kLength / kTiles, dy = kDepth / kTiles;
      w.mesh().rectangle(SE3(), Vec3(i * dx, (j + 1) * dy, 0), Vec3(dx, 0, 0), Vec3(0, -dy, 0),
                         Cover(paving, Cover::Fit::random, 0.07));
    }
  }
  const Vec2 corners[] = {{0, 0}, {0, kDepth}, {kLength, kDepth}, {kLength, 0}};
  for (size_t i = 0; i < 4; ++i) facade(w, corners[i], corners[(i + 1) % 4], walls, glass);
  tree(w, place(11, 8.5, 0), 4.6);
  tree(w, place(8.6, 9.3, 0, 40), 3.8);
  tree(w, place(13.5, 7.8, 0, 110), 4.1);
  bench(w, place(8.2, 7.2, 0));
  bench(w, place(14.2, 9.9, 0, 180));
  bench(w, place(1.0, 6.5, 0, 90));
  far_walls(w, walls[1], glass);
  w.lights.sun = {.towards = Vec3f(0.35f, -0.55f, 0.76f).normalized(), .irradiance = Color(1.7f, 1.6f, 1.4f, 0)};
  const uint32_t clouds = w.seed();
  w.lights.sky = [clouds](const Vec3f& direction) { return sky(direction, clouds); };
  return std::move(w).finish(executor);
}

Tour courtyard_tour() {
  return {walk_along({{3.6, 3.4}, {18.4, 3.4}, {18.4, 13.6}, {3.6, 13.6}}, 2.5, 1.0, 4.5, 1.6), 48};
}

}  // namespace photoslam::synthetic
