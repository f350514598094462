// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/furniture/furniture.h"
#include "sources/synthetic/worlds/passage.h"
#include "sources/synthetic/worlds/worlds.h"

namespace photoslam::synthetic {
namespace {

// Two rooms side by side, with a wall between them that has two doorways: a round through both is a loop.
const Vec3 kSize(10.4, 4.2, 2.6);
constexpr double kWall = 5.2, kThick = 0.15, kHead = 2.1;
constexpr double kOpenings[2][2] = {{0.55, 1.45}, {2.75, 3.65}};

void partition(Workshop& w) {
  const int west = w.material(3.0f, 2.6f, 260, wallpaper(rgb(0xCBD3C0), w.seed()), {.gloss = 0.01f});
  BoxCovers covers(Cover(west, Cover::Fit::aligned, 0.05));
  const auto solid = [&](double south, double north, double bottom) {
    w.mesh().box(SE3(), Vec3(kWall, south, bottom), Vec3(kThick, north - south, kSize.z() - bottom), covers);
  };
  solid(0, kOpenings[0][0], 0);
  solid(kOpenings[0][1], kOpenings[1][0], 0);
  solid(kOpenings[1][1], kSize.y(), 0);
  const BoxCovers casing(Cover(w.oak, Cover::Fit::random, 0.04));
  for (const auto& [south, north] : kOpenings) {
    solid(south, north, kHead);
    for (const double y : {south, north - 0.04}) {
      w.mesh().box(SE3(), Vec3(kWall - 0.02, y, 0), Vec3(kThick + 0.04, 0.04, kHead), casing);
    }
  }
}

void west_room(Workshop& w) {
  bookshelf(w, place(0.42, kSize.y() - 0.33, 0), 1.5, 2.0, 6);
  desk(w, place(2.05, kSize.y() - 0.76, 0));
  sofa(w, place(0.98, 0.75, 0, 90), 2.05);
  coffee_table(w, place(1.3, 1.6, 0, 84));
  ceiling_ball(w, {2.2, 2.5, kSize.z() - 0.35});
  ceiling_ball(w, {4.2, 1.6, kSize.z() - 0.35});
  tiled_stove(w, place(2.5, 0.53, 0, 180));
  cupboard(w, place(3.7, 0.47, 0, 180), 0.95);
  framed_picture(w, place(0.004, 1.75, 1.68, 90), 0.86, 0.62, PictureKind::map, w.walnut);
  framed_picture(w, place(0.004, 0.8, 1.62, 90), 0.5, 0.66, PictureKind::abstract, w.oak);
  framed_picture(w, place(3.0, kSize.y() - 0.004, 1.75), 0.62, 0.46, PictureKind::landscape, w.oak);
  framed_picture(w, place(4.2, kSize.y() - 0.004, 1.6), 0.5, 0.66, PictureKind::botanical, w.black);
  framed_picture(w, place(4.4, 0.004, 1.6, 180), 0.6, 0.8, PictureKind::skyline, w.black);
  framed_picture(w, place(kWall - 0.004, 2.1, 1.6, -90), 0.7, 0.5, PictureKind::landscape, w.white);
}

void east_room(Workshop& w) {
  bookshelf(w, place(6.2, kSize.y() - 0.33, 0), 1.5, 2.0, 6);
  sideboard(w, place(8.2, kSize.y() - 0.45, 0), 1.1);
  potted_plant(w, place(10.0, 3.7, 0), 0.34, 0.6, 30);
  coffee_table(w, place(6.7, 1.75, 0, 6));
  armchair(w, place(9.4, 0.8, 0, -130));
  cupboard(w, place(7.3, 0.47, 0, 180), 0.95);
  wicker_basket(w, place(8.0, 0.4, 0), 0.2, 0.32);
  const int seat = w.material(0.5f, 0.5f, 500, flowers(w.seed()), {.gloss = 0.005f});
  wooden_chair(w, place(9.7, 2.9, 0, -75), seat);
  framed_picture(w, place(8.75, kSize.y() - 0.004, 1.7), 0.8, 0.6, PictureKind::map, w.oak);
  framed_picture(w, place(9.6, kSize.y() - 0.004, 1.75), 0.4, 0.5, PictureKind::shapes, w.white);
  framed_picture(w, place(8.2, 0.004, 1.7, 180), 0.7, 0.9, PictureKind::abstract, w.walnut);
  framed_picture(w, place(kWall + kThick + 0.004, 2.1, 1.6, 90), 0.7, 0.5, PictureKind::botanical, w.black);
  pendant_lamp(w, Vec3(7.6, 2.1, 2.13), kSize.z());
}

}  // namespace

SceneModel build_house(uint64_t seed, SceneQuality quality, Executor& executor) {
  Workshop w(seed, quality);
  shell(w, kSize);
  partition(w);
  west_room(w);
  east_room(w);
  SceneModel model = std::move(w).finish(executor);
  hang_backdrop(model, kSize, seed, executor);
  return model;
}

Tour house_tour() {
  const auto at = [](double x, double y, double to_x, double to_y) {
    return Waypoint{{x, y, 1.48}, {to_x, to_y, 0.95}};
  };
  return {{at(4.4, 1.15, 1.5, 1.8), at(3.7, 1.25, 0.8, 2.2), at(3.1, 1.6, 0.6, 3.0), at(2.9, 2.15, 1.4, 4.0),
           at(3.2, 2.45, 3.0, 5.2), at(3.7, 2.8, 5.2, 4.9), at(4.4, 3.15, 7.0, 4.0), at(5.27, 3.2, 8.2, 3.4),
           at(6.2, 3.1, 9.4, 3.0), at(7.0, 2.95, 10.1, 2.2), at(7.7, 2.65, 10.3, 1.2), at(8.2, 2.3, 9.7, 0.0),
           at(8.35, 1.9, 8.5, -0.6), at(8.1, 1.45, 7.0, -0.7), at(7.5, 1.15, 5.4, -0.2), at(6.8, 1.02, 4.0, 0.5),
           at(6.1, 1.0, 3.0, 0.9), at(5.27, 1.0, 2.2, 1.3)},
          20};
}

}  // namespace photoslam::synthetic
