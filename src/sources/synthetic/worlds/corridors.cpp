// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/worlds/passage.h"
#include "sources/synthetic/worlds/worlds.h"

namespace photoslam::synthetic {
namespace {

// A square of four corridors round a closed block.
constexpr double kOuter = 19, kWidth = 2.4, kHeight = 2.7;
constexpr PictureKind kKinds[] = {PictureKind::landscape, PictureKind::map,      PictureKind::shapes,
                                  PictureKind::skyline,   PictureKind::abstract, PictureKind::botanical};

/// Something every two metres, never twice the same.
void hang_things(Workshop& w, const Vec2& from, const Vec2& to, bool furniture) {
  const double length = (to - from).norm();
  for (double along = 1.6; along < length - 1.6; along += w.random().uniform(1.5, 2.4)) {
    const double kind = w.random().uniform();
    const int timbers[] = {w.oak, w.walnut, w.black, w.white, w.birch};
    const int timber = timbers[w.random().next() % std::size(timbers)];
    if (kind < 0.16) {
      door_leaf(w, at_wall(from, to, along - 0.45, 0), timber == w.black ? w.oak : timber);
    } else if (kind < 0.3 && furniture) {
      sideboard(w, at_wall(from, to, along - 0.5, 0) * place(0, -0.42, 0), 0.95);
    } else if (kind < 0.42 && furniture) {
      potted_plant(w, at_wall(from, to, along, 0) * place(0, -0.3, 0), 0.3, 0.45, 14);
    } else {
      framed_picture(w, at_wall(from, to, along, w.random().uniform(1.4, 1.75)) * place(0, -0.004, 0),
                     w.random().uniform(0.4, 0.95), w.random().uniform(0.4, 0.8),
                     kKinds[w.random().next() % std::size(kKinds)], timber);
    }
  }
}

void floor_and_ceiling(Workshop& w) {
  const int wood =
      w.material(8, static_cast<float>(kWidth), 220, parquet(w.seed()), {.gloss = 0.05f, .roughness = 0.12f});
  const int stone = w.material(8, static_cast<float>(kWidth), 180, tiles(0.3f, w.seed()), {.gloss = 0.05f});
  const int ceiling = w.material(3, 3, 120, plaster(rgb(0xE9E4DA), w.seed()), {.gloss = 0});
  const auto strip = [&](const Vec2& corner, const Vec2& size, int floor) {
    w.mesh().rectangle(SE3(), Vec3(corner.x(), corner.y() + size.y(), 0), Vec3(size.x(), 0, 0), Vec3(0, -size.y(), 0),
                       Cover(floor, Cover::Fit::random, 0.08));
    w.mesh().rectangle(SE3(), Vec3(corner.x(), corner.y(), kHeight), Vec3(size.x(), 0, 0), Vec3(0, size.y(), 0),
                       Cover(ceiling, Cover::Fit::random, 0.15));
  };
  constexpr double kInner = kOuter - kWidth;
  strip({0, 0}, {kOuter, kWidth}, wood);
  strip({0, kInner}, {kOuter, kWidth}, stone);
  strip({0, kWidth}, {kWidth, kInner - kWidth}, stone);
  strip({kInner, kWidth}, {kWidth, kInner - kWidth}, wood);
}

}  // namespace

SceneModel build_corridors(uint64_t seed, SceneQuality quality, Executor& executor) {
  Workshop w(seed, quality);
  floor_and_ceiling(w);
  const std::vector<int> materials = wall_materials(w, kHeight);
  constexpr double kInner = kOuter - kWidth;
  // Outer walls are seen from inside the square, the block's from outside: left to right as one faces them.
  const Vec2 outer[] = {{0, 0}, {0, kOuter}, {kOuter, kOuter}, {kOuter, 0}};
  const Vec2 block[] = {{kWidth, kWidth}, {kInner, kWidth}, {kInner, kInner}, {kWidth, kInner}};
  for (size_t i = 0; i < 4; ++i) {
    long_wall(w, outer[i], outer[(i + 1) % 4], kHeight, materials);
    hang_things(w, outer[i], outer[(i + 1) % 4], /*furniture=*/true);
    long_wall(w, block[i], block[(i + 1) % 4], kHeight, materials);
    hang_things(w, block[i], block[(i + 1) % 4], /*furniture=*/false);
  }
  constexpr double kMiddle = kWidth / 2;
  for (double at = 2.5; at < kOuter - 1; at += 4.6) {
    for (const Vec2& p : {Vec2(at, kMiddle), Vec2(kOuter - at, kOuter - kMiddle), Vec2(kMiddle, kOuter - at),
                          Vec2(kOuter - kMiddle, at)}) {
      ceiling_ball(w, {p.x(), p.y(), kHeight - 0.3});
    }
  }
  return std::move(w).finish(executor);
}

Tour corridors_tour() {
  constexpr double kNear = kWidth / 2 + 0.1, kFar = kOuter - kNear;
  return {walk_along({{kNear, kNear}, {kFar, kNear}, {kFar, kFar}, {kNear, kFar}}, 1.2, 0.9, 2.6, 1.5), 72};
}

}  // namespace photoslam::synthetic
