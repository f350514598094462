// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/worlds/passage.h"
#include "sources/synthetic/worlds/worlds.h"

namespace photoslam::synthetic {
namespace {

// A long corridor whose doors are all alike; only what hangs between some of them differs.
constexpr double kLength = 34, kWidth = 3.4, kHeight = 2.8, kEvery = 2.6;

void side(Workshop& w, const Vec2& from, const Vec2& to, int wall) {
  long_wall(w, from, to, kHeight, {wall});
  int number = 0;
  for (double along = 1.2; along < kLength - 1.2; along += kEvery, ++number) {
    door_leaf(w, at_wall(from, to, along, 0), w.oak);
    if (number % 3 == 1) {
      const auto kind = number % 2 == 0 ? PictureKind::landscape : PictureKind::abstract;
      framed_picture(w, at_wall(from, to, along + 1.75, 1.6) * place(0, -0.004, 0), 0.6, 0.8, kind, w.black);
    }
  }
}

}  // namespace

SceneModel build_doors(uint64_t seed, SceneQuality quality, Executor& executor) {
  Workshop w(seed, quality);
  const int floor =
      w.material(8, static_cast<float>(kWidth), 220, parquet(w.seed()), {.gloss = 0.05f, .roughness = 0.12f});
  const int ceiling = w.material(3, 3, 120, plaster(rgb(0xE9E4DA), w.seed()), {.gloss = 0});
  const int wall = w.material(5, static_cast<float>(kHeight), 240, plaster(rgb(0xC9B592), w.seed()), {.gloss = 0.01f});
  w.mesh().rectangle(SE3(), Vec3(0, kWidth, 0), Vec3(kLength, 0, 0), Vec3(0, -kWidth, 0),
                     Cover(floor, Cover::Fit::random, 0.08));
  w.mesh().rectangle(SE3(), Vec3(0, 0, kHeight), Vec3(kLength, 0, 0), Vec3(0, kWidth, 0),
                     Cover(ceiling, Cover::Fit::random, 0.15));
  side(w, {0, kWidth}, {kLength, kWidth}, wall);
  side(w, {kLength, 0}, {0, 0}, wall);
  long_wall(w, {0, 0}, {0, kWidth}, kHeight, wall_materials(w, kHeight));
  long_wall(w, {kLength, kWidth}, {kLength, 0}, kHeight, wall_materials(w, kHeight));
  framed_picture(w, at_wall({0, 0}, {0, kWidth}, 1.7, 1.6) * place(0, -0.004, 0), 1.2, 0.9, PictureKind::map, w.walnut);
  framed_picture(w, at_wall({kLength, kWidth}, {kLength, 0}, 1.7, 1.6) * place(0, -0.004, 0), 1.2, 0.9,
                 PictureKind::skyline, w.oak);
  for (double x = 2; x < kLength; x += 4.3) ceiling_ball(w, {x, kWidth / 2, kHeight - 0.3});
  return std::move(w).finish(executor);
}

Tour doors_tour() {
  const double south = kWidth / 2 - 0.8, north = kWidth / 2 + 0.8;
  return {walk_along({{2.2, south}, {kLength - 2.2, south}, {kLength - 2.2, north}, {2.2, north}}, 0.75, 0.8, 3.0, 1.5),
          80};
}

}  // namespace photoslam::synthetic
