// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/worlds/passage.h"

#include <numbers>

namespace photoslam::synthetic {

std::vector<int> wall_materials(Workshop& w, double height) {
  const float h = static_cast<float>(height);
  constexpr float kLength = 5, kTexels = 240;
  const Finish matt{.gloss = 0.01f};
  return {w.material(kLength, h, kTexels, brick_wall(w.seed()), matt),
          w.material(kLength, h, kTexels, plaster(rgb(0xC9B592), w.seed()), matt),
          w.material(kLength, h, kTexels, wallpaper(rgb(0xE2D9C2), w.seed()), matt),
          w.material(kLength, h, kTexels, plaster(rgb(0x9FAA98), w.seed()), matt),
          w.material(kLength, h, kTexels, wallpaper(rgb(0xC4CDD6), w.seed()), matt)};
}

void long_wall(Workshop& w, const Vec2& from, const Vec2& to, double height, const std::vector<int>& materials) {
  constexpr double kPiece = 4;
  const int pieces = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kPiece)));
  const Vec2 step = (to - from) / pieces;
  for (int i = 0; i < pieces; ++i) {
    const Vec2 left = from + i * step;
    const int material = materials[w.random().next() % materials.size()];
    w.mesh().rectangle(SE3(), Vec3(left.x(), left.y(), height), Vec3(step.x(), step.y(), 0), Vec3(0, 0, -height),
                       Cover(material, Cover::Fit::aligned, 0.08));
  }
}

SE3 at_wall(const Vec2& from, const Vec2& to, double along, double up) {
  const Vec2 right = (to - from).normalized();
  const Vec2 point = from + along * right;
  // An object's x axis points to the right as seen from the front.
  return place(point.x(), point.y(), up, std::atan2(right.y(), right.x()) * 180 / std::numbers::pi);
}

void door_leaf(Workshop& w, const SE3& frame, int timber) {
  constexpr double kWidth = 0.9, kHeight = 2.05;
  MeshBuilder& mesh = w.mesh();
  const BoxCovers leaf(Cover(timber, Cover::Fit::random, 0.05));
  const BoxCovers casing(Cover(w.white, Cover::Fit::random, 0.05));
  mesh.box(frame, Vec3(0, -0.03, 0), Vec3(kWidth, 0.03, kHeight), leaf);
  for (const double z : {0.12, 1.12}) {
    for (const double x : {0.1, 0.5}) mesh.box(frame, Vec3(x, -0.045, z), Vec3(0.3, 0.016, z < 1 ? 0.86 : 0.8), leaf);
  }
  mesh.box(frame, Vec3(-0.09, -0.05, 0), Vec3(0.09, 0.05, kHeight + 0.09), casing);
  mesh.box(frame, Vec3(kWidth, -0.05, 0), Vec3(0.09, 0.05, kHeight + 0.09), casing);
  mesh.box(frame, Vec3(0, -0.05, kHeight), Vec3(kWidth, 0.05, 0.09), casing);
  const Vec3 handle[] = {{kWidth - 0.05, -0.05, 1.02}, {kWidth - 0.05, -0.085, 1.02}, {kWidth - 0.17, -0.085, 1.015}};
  mesh.tube(frame, handle, 0.01, Cover(w.brass, Cover::Fit::random, 0.02));
}

void ceiling_ball(Workshop& w, const Vec3& position) {
  constexpr double kRadius = 0.14;
  const int glass = w.paint(rgb(0xFBF3E2), {.gloss = 0, .emission = 1.2f});
  w.mesh().sphere(place(position.x(), position.y(), position.z()), kRadius, Cover(glass, Cover::Fit::stretch, 0.1), 16);
  w.lights.areas.push_back({.center = position.cast<float>(),
                            .radius = static_cast<float>(kRadius) + 0.02f,
                            .radiance = Color(22.0f, 20.0f, 17.0f, 0)});
}

}  // namespace photoslam::synthetic
