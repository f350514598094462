// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/furniture/furniture.h"

namespace photoslam::synthetic {
namespace {

void wall_things(Workshop& w, const Vec3& size) {
  // North: pictures over the desk and the sideboard. A little off the wall, tilted as pictures are.
  const double north = size.y() - 0.004;
  const float board_width = 1.15f, board_height = 0.75f;
  const int board =
      w.material(board_width, board_height, 500, pin_board(board_width, board_height, w.seed()), {.gloss = 0.01f});
  BoxCovers covers(w.oak);
  covers.front = Cover(board, Cover::Fit::stretch, 0.03);
  w.mesh().box(place(2.1, north - 0.02, 1.28), Vec3(0, 0, 0), Vec3(board_width, 0.02, board_height), covers);
  framed_picture(w, place(3.68, north, 1.86), 0.42, 0.56, PictureKind::botanical, w.black);
  framed_picture(w, place(4.28, north, 1.62), 0.62, 0.46, PictureKind::landscape, w.oak);
  framed_picture(w, place(4.22, north, 2.14), 0.46, 0.34, PictureKind::shapes, w.white);
  const int dial = w.material(0.3f, 0.3f, 500, clock_face(0.3f), {.gloss = 0.04f});
  const SE3 clock = place(3.64, north - 0.025, 1.36);
  w.mesh().box(clock, Vec3(-0.12, 0, -0.12), Vec3(0.24, 0.025, 0.24), [&] {
    BoxCovers c(w.brass);
    c.front = Cover(dial, Cover::Fit::stretch, 0.04);
    return c;
  }());

  // West: over the sofa.
  const auto west = [](double y, double z) { return place(0.004, y, z, 90); };
  framed_picture(w, west(0.95, 1.62), 0.5, 0.66, PictureKind::abstract, w.oak);
  framed_picture(w, west(1.75, 1.68), 0.86, 0.62, PictureKind::map, w.walnut);
  framed_picture(w, west(2.5, 1.8), 0.4, 0.3, PictureKind::landscape, w.white);
  framed_picture(w, west(2.5, 1.43), 0.34, 0.34, PictureKind::shapes, w.black);

  // South: a gallery between the cupboard and the door.
  const auto south = [](double x, double z) { return place(x, 0.004, z, 180); };
  framed_picture(w, south(3.25, 1.72), 0.62, 0.8, PictureKind::skyline, w.black);
  framed_picture(w, south(2.5, 1.98), 0.5, 0.4, PictureKind::landscape, w.oak);
  framed_picture(w, south(2.52, 1.48), 0.4, 0.5, PictureKind::botanical, w.walnut);

  // East, beside the window.
  framed_picture(w, place(size.x() - 0.004, 0.42, 1.62, -90), 0.4, 0.54, PictureKind::abstract, w.oak);
}

void carpet(Workshop& w, const SE3& frame, double width, double depth) {
  const float fw = static_cast<float>(width), fd = static_cast<float>(depth);
  const int wool = w.material(fw, fd, 450, rug(fw, fd, w.seed()), {.gloss = 0.005f});
  BoxCovers covers(w.linen);
  covers.top = Cover(wool, Cover::Fit::stretch, 0.02);
  w.mesh().box(frame, Vec3(0, 0, 0.0005), Vec3(width, depth, 0.009), covers);
  // Fringes at the short sides.
  for (int i = 0; i < 90; ++i) {
    const double y = (i + 0.5) / 90 * depth, bend = w.random().uniform(-0.012, 0.012);
    for (const double side : {-1.0, 1.0}) {
      const double x = side < 0 ? 0.0 : width;
      const Vec3 path[] = {{x, y, 0.006}, {x + side * 0.03, y + 0.4 * bend, 0.004}, {x + side * 0.06, y + bend, 0.003}};
      w.mesh().tube(frame, path, 0.0025, Cover(w.pages, Cover::Fit::random, 0.03), 4);
    }
  }
}

}  // namespace

void framed_picture(Workshop& w, const SE3& frame, double width, double height, PictureKind kind, int moulding) {
  MeshBuilder& mesh = w.mesh();
  constexpr double kRail = 0.028, kThick = 0.026;
  const double mat = 0.1 * std::min(width, height);
  const double inner_width = width - 2 * kRail, inner_height = height - 2 * kRail;
  const BoxCovers timber(Cover(moulding, Cover::Fit::random, 0.02));
  const auto rail = [&](double x, double z, double w_x, double w_z) {
    mesh.box(frame, Vec3(x, -kThick, z), Vec3(w_x, kThick, w_z), timber);
  };
  rail(-width / 2, -height / 2, kRail, height);
  rail(width / 2 - kRail, -height / 2, kRail, height);
  rail(-width / 2 + kRail, height / 2 - kRail, inner_width, kRail);
  rail(-width / 2 + kRail, -height / 2, inner_width, kRail);
  mesh.rectangle(frame, Vec3(-inner_width / 2, -0.006, inner_height / 2), Vec3(inner_width, 0, 0),
                 Vec3(0, 0, -inner_height), Cover(w.white, Cover::Fit::random, 0.02));
  const double art_width = inner_width - 2 * mat, art_height = inner_height - 2 * mat;
  const float fw = static_cast<float>(art_width), fh = static_cast<float>(art_height);
  const int art = w.material(fw, fh, 500, picture(kind, fw, fh, w.seed()), {.gloss = 0.03f, .roughness = 0.1f});
  mesh.rectangle(frame, Vec3(-art_width / 2, -0.008, art_height / 2), Vec3(art_width, 0, 0), Vec3(0, 0, -art_height),
                 Cover(art, Cover::Fit::stretch, 0.02));
}

void floor_lamp(Workshop& w, const SE3& frame) {
  const int shade = w.material(1.1f, 0.3f, 400, curtain(rgb(0xF3E3C0), w.seed()),
                               {.gloss = 0, .emission = 0.6f, .translucency = 0.5f});
  MeshBuilder& mesh = w.mesh();
  mesh.lathe(frame, std::vector<Vec2>{{0, 0.03}, {0.02, 0.03}, {0.15, 0.015}, {0.15, 0}, {0, 0}},
             Cover(w.black, Cover::Fit::random, 0.02), 28);
  mesh.cylinder(frame, 0.012, 1.5, Cover(w.brass, Cover::Fit::random, 0.03), 12);
  const Vec2 cone[] = {{0.15, 1.68}, {0.22, 1.4}}, inside[] = {{0.22, 1.4}, {0.15, 1.68}};
  mesh.lathe(frame, cone, Cover(shade, Cover::Fit::stretch, 0.03), 36);
  mesh.lathe(frame, inside, Cover(shade, Cover::Fit::stretch, 0.03), 36);
  const Vec3 glow = frame * Vec3(0, 0, 1.54);
  w.lights.areas.push_back({.center = glow.cast<float>(), .radius = 0.24f, .radiance = Color(1.7f, 1.25f, 0.75f, 0)});
}

SceneModel furnish_room(uint64_t seed, const Vec3& size, SceneQuality quality, Executor& executor) {
  Workshop w(seed, quality);
  shell(w, size);
  carpet(w, place(1.2, 1.05, 0, 3), 2.5, 1.7);

  // North side.
  bookshelf(w, place(0.42, size.y() - 0.33, 0), 1.5, 2.0, 6);
  desk(w, place(2.05, size.y() - 0.76, 0));
  const int seat = w.material(0.5f, 0.5f, 500, flowers(w.seed()), {.gloss = 0.005f});
  wooden_chair(w, place(2.98, 2.86, 0, 155), seat);
  sideboard(w, place(3.8, size.y() - 0.45, 0), 0.95);
  potted_plant(w, place(4.93, 3.62, 0), 0.34, 0.6, 30);

  // West side.
  sofa(w, place(0.98, 0.75, 0, 90), 2.05);
  floor_lamp(w, place(0.42, 3.28, 0));
  wicker_basket(w, place(0.62, 0.42, 0), 0.2, 0.32);

  // Middle.
  coffee_table(w, place(1.5, 1.5, 0, 6));
  book_pile(w, place(2.95, 1.72, 0.0095, 30), 3);

  // East and south.
  armchair(w, place(4.05, 0.75, 0, -130));
  tiled_stove(w, place(2.1, 0.53, 0, 180));
  cupboard(w, place(1.2, 0.47, 0, 180), 0.95);
  bookshelf(w, place(3.32, 0.35, 0, 180), 1.05, 0.84, 3);
  wall_things(w, size);

  SceneModel model = std::move(w).finish(executor);
  hang_backdrop(model, size, seed, executor);
  return model;
}

void hang_backdrop(SceneModel& model, const Vec3& size, uint64_t seed, Executor& executor) {
  constexpr float kWidth = 14, kHeight = 8;
  model.backdrop = Texture::paint(kWidth, kHeight, 90, garden(kWidth, kHeight, static_cast<uint32_t>(seed)), executor);
  const float x = static_cast<float>(size.x()) + 3.5f;
  model.backdrop_corner = Vec3f(x, 9, 5.6f);
  model.backdrop_right = Vec3f(0, -kWidth, 0);
  model.backdrop_down = Vec3f(0, 0, -kHeight);
}

}  // namespace photoslam::synthetic
