// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "sources/synthetic/furniture/furniture.h"

namespace photoslam::synthetic {
namespace {

void table_top(Workshop& w, const SE3& frame, const Vec3& corner, const Vec3& size, int material) {
  BoxCovers covers(Cover(material, Cover::Fit::random, 0.03));
  covers.top.light_spacing = 0.0125;
  w.mesh().box(frame, corner, size, covers);
}

void screen(Workshop& w, const SE3& frame, double width, double height) {
  MeshBuilder& mesh = w.mesh();
  const int code = w.material(static_cast<float>(width), static_cast<float>(height), 800,
                              code_editor(static_cast<float>(width), static_cast<float>(height), w.seed()),
                              {.gloss = 0.04f, .roughness = 0.08f, .emission = 0.55f});
  mesh.box(frame, Vec3(-width / 2 - 0.012, 0, 0.12), Vec3(width + 0.024, 0.03, height + 0.024), BoxCovers(w.black));
  mesh.rectangle(frame, Vec3(-width / 2, -0.001, 0.132 + height), Vec3(width, 0, 0), Vec3(0, 0, -height),
                 Cover(code, Cover::Fit::stretch));
  mesh.box(frame, Vec3(-0.025, 0.03, 0.02), Vec3(0.05, 0.02, 0.3), BoxCovers(w.steel));
  mesh.rounded_box(frame * place(0, 0.04, 0.006), Vec3(0.26, 0.2, 0.012), 0.006, 0,
                   Cover(w.steel, Cover::Fit::random, 0.02));
}

/// A cabinet: carcass, doors or drawers with knobs, short legs.
void cabinet(Workshop& w, const SE3& frame, const Vec3& size, int columns, int rows, int carcass, int front) {
  MeshBuilder& mesh = w.mesh();
  constexpr double kLeg = 0.12, kGap = 0.004;
  BoxCovers covers(Cover(carcass, Cover::Fit::random, 0.04));
  covers.top.light_spacing = 0.015;
  mesh.box(frame, Vec3(0, 0, kLeg), Vec3(size.x(), size.y(), size.z() - kLeg), covers);
  const double cell_x = (size.x() - 0.04) / columns, cell_z = (size.z() - kLeg - 0.05) / rows;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const Vec3 corner(0.02 + c * cell_x + kGap, -0.018, kLeg + 0.02 + r * cell_z + kGap);
      const Vec3 panel(cell_x - 2 * kGap, 0.018, cell_z - 2 * kGap);
      mesh.box(frame, corner, panel, BoxCovers(Cover(front, Cover::Fit::random, 0.03)));
      // A raised field with a shadow line around it.
      const double rim = std::min(0.05, 0.2 * std::min(panel.x(), panel.z()));
      mesh.box(frame, corner + Vec3(rim, -0.006, rim), panel - Vec3(2 * rim, 0.012, 2 * rim),
               BoxCovers(Cover(front, Cover::Fit::random, 0.03)));
      const double knob_x = panel.z() > panel.x() ? (c % 2 == 0 ? panel.x() - 0.03 : 0.03) : panel.x() / 2;
      mesh.sphere(frame * place(corner.x() + knob_x, -0.035, corner.z() + panel.z() / 2), 0.015,
                  Cover(w.brass, Cover::Fit::random, 0.01), 12);
    }
  }
  for (const double x : {0.06, size.x() - 0.06}) {
    for (const double y : {0.05, size.y() - 0.05}) {
      mesh.cylinder(frame * place(x, y, 0), 0.02, kLeg, Cover(carcass, Cover::Fit::random, 0.03), 10);
    }
  }
}

}  // namespace

void desk(Workshop& w, const SE3& frame) {
  constexpr double kWidth = 1.6, kDepth = 0.72, kTop = 0.75;
  MeshBuilder& mesh = w.mesh();
  table_top(w, frame, Vec3(0, 0, kTop - 0.035), Vec3(kWidth, kDepth, 0.035), w.oak);
  const BoxCovers timber(Cover(w.oak, Cover::Fit::random, 0.03));
  for (const double x : {0.04, kWidth - 0.1}) {
    for (const double y : {0.04, kDepth - 0.1}) mesh.box(frame, Vec3(x, y, 0), Vec3(0.06, 0.06, kTop - 0.035), timber);
  }
  mesh.box(frame, Vec3(0.1, kDepth - 0.07, kTop - 0.13), Vec3(kWidth - 0.2, 0.02, 0.095), timber);
  mesh.box(frame, Vec3(kWidth - 0.52, 0.05, 0.28), Vec3(0.42, kDepth - 0.1, kTop - 0.33), timber);
  for (int i = 0; i < 2; ++i) {
    const double z = 0.295 + 0.2 * i;
    mesh.box(frame, Vec3(kWidth - 0.51, 0.034, z), Vec3(0.4, 0.016, 0.185),
             BoxCovers(Cover(w.walnut, Cover::Fit::random, 0.03)));
    mesh.sphere(frame * place(kWidth - 0.31, 0.02, z + 0.09), 0.014, Cover(w.brass, Cover::Fit::random, 0.01), 12);
  }

  const SE3 top = frame * place(0, 0, kTop);
  screen(w, top * place(0.78, 0.45, 0, 4), 0.54, 0.32);
  const int keys = w.material(0.44f, 0.14f, 800, keyboard(0.44f, 0.14f, w.seed()), {.gloss = 0.04f});
  BoxCovers board(w.black);
  board.top = Cover(keys, Cover::Fit::stretch, 0.02);
  mesh.box(top * place(0.76, 0.2, 0, -3), Vec3(-0.22, -0.07, 0), Vec3(0.44, 0.14, 0.018), board);
  mesh.rounded_box(top * place(1.08, 0.2, 0.016, 15), Vec3(0.06, 0.1, 0.032), 0.015, 0.004,
                   Cover(w.black, Cover::Fit::random, 0.01));
  table_lamp(w, top * place(0.16, 0.5, 0, -30));
  book_pile(w, top * place(1.38, 0.52, 0, 20), 5);
  globe_on_stand(w, top * place(0.4, 0.53, 0));
  mug(w, top * place(0.42, 0.24, 0, 40), rgb(0xB5472F));
  printed_sheet(w, top * place(0.24, 0.22, 0.0012, 12), 0.21, 0.297);
  printed_sheet(w, top * place(1.3, 0.19, 0.0012, -9), 0.21, 0.297);
  printed_sheet(w, top * place(1.36, 0.21, 0.0024, 17), 0.148, 0.21);
  // A jar of pencils.
  mesh.lathe(top * place(1.12, 0.56, 0), std::vector<Vec2>{{0.036, 0.1}, {0.04, 0.1}, {0.04, 0}, {0, 0}},
             Cover(w.clay, Cover::Fit::random, 0.015), 20);
  for (int i = 0; i < 9; ++i) {
    const double angle = 0.7 * i, lean = 0.03 * w.random().uniform(0.5, 1.0);
    const Vec3 path[] = {{lean * std::cos(angle), lean * std::sin(angle), 0.17 + 0.03 * w.random().uniform()},
                         {0.01 * std::cos(angle), 0.01 * std::sin(angle), 0.01}};
    mesh.tube(top * place(1.12, 0.56, 0), path, 0.0042,
              Cover(w.paint(hue(0.13f * static_cast<float>(i), 0.7f, 0.8f)), Cover::Fit::random, 0.03), 6);
  }
}

void coffee_table(Workshop& w, const SE3& frame) {
  constexpr double kWidth = 1.15, kDepth = 0.62, kTop = 0.43;
  MeshBuilder& mesh = w.mesh();
  table_top(w, frame, Vec3(0, 0, kTop - 0.04), Vec3(kWidth, kDepth, 0.04), w.walnut);
  table_top(w, frame, Vec3(0.05, 0.05, 0.13), Vec3(kWidth - 0.1, kDepth - 0.1, 0.02), w.walnut);
  for (const double x : {0.03, kWidth - 0.08}) {
    for (const double y : {0.03, kDepth - 0.08})
      mesh.box(frame, Vec3(x, y, 0), Vec3(0.05, 0.05, kTop - 0.04),
               BoxCovers(Cover(w.walnut, Cover::Fit::random, 0.03)));
  }
  book_pile(w, frame * place(0.35, 0.3, 0.151, 8), 3);
  wicker_basket(w, frame * place(0.8, 0.32, 0.151), 0.16, 0.13);
  const SE3 top = frame * place(0, 0, kTop);
  // A tray of painted tiles with the tea things.
  const int tile = w.material(0.42f, 0.3f, 600, tiles(0.06f, w.seed()), {.gloss = 0.06f, .roughness = 0.1f});
  const SE3 tray = top * place(0.28, 0.32, 0, 7);
  BoxCovers covers(w.oak);
  covers.top = Cover(tile, Cover::Fit::stretch, 0.0125);
  mesh.box(tray, Vec3(-0.21, -0.15, 0.004), Vec3(0.42, 0.3, 0.012), covers);
  teapot(w, tray * place(-0.08, 0.03, 0.016, 30));
  mug(w, tray * place(0.11, 0.06, 0.016, -20), rgb(0x33658A));
  mug(w, tray * place(0.1, -0.08, 0.016, 70), rgb(0xE0A64B));
  fruit_bowl(w, top * place(0.72, 0.4, 0));
  book_pile(w, top * place(0.95, 0.2, 0, 80), 2);
  printed_sheet(w, top * place(0.68, 0.14, 0.0012, -16), 0.21, 0.28);
  candles(w, top * place(1.04, 0.48, 0));
}

void sideboard(Workshop& w, const SE3& frame, double width) {
  constexpr double kHeight = 0.78;
  cabinet(w, frame, Vec3(width, 0.42, kHeight), 2, 3, w.walnut, w.oak);
  const SE3 top = frame * place(0, 0, kHeight);
  vase(w, top * place(0.22, 0.22, 0), 0.3, true);
  table_lamp(w, top * place(width - 0.2, 0.24, 0, 160));
  book_pile(w, top * place(0.55, 0.2, 0, -6), 4);
  mug(w, top * place(0.72, 0.13, 0), rgb(0x7FA08C));
}

void cupboard(Workshop& w, const SE3& frame, double width) {
  const int paint =
      w.material(1.0f, 1.0f, 500, wood(rgb(0x5F7F73), rgb(0x46625A), w.seed()), {.gloss = 0.04f, .roughness = 0.2f});
  cabinet(w, frame, Vec3(width, 0.45, 1.75), 2, 2, paint, paint);
  wicker_basket(w, frame * place(0.25, 0.22, 1.75), 0.17, 0.22);
  wicker_basket(w, frame * place(0.72, 0.24, 1.75), 0.2, 0.16);
}

void tiled_stove(Workshop& w, const SE3& frame) {
  const int tile = w.material(0.72f, 1.6f, 450, tiles(0.12f, w.seed()), {.gloss = 0.06f, .roughness = 0.1f});
  MeshBuilder& mesh = w.mesh();
  const BoxCovers covers(Cover(tile, Cover::Fit::aligned, 0.04));
  mesh.box(frame, Vec3(0, 0, 0.1), Vec3(0.72, 0.5, 0.95), covers);
  mesh.box(frame, Vec3(0.06, 0.05, 1.05), Vec3(0.6, 0.45, 0.7), covers);
  mesh.box(frame, Vec3(-0.03, -0.03, 0), Vec3(0.78, 0.53, 0.1), BoxCovers(w.clay));
  mesh.box(frame, Vec3(-0.02, -0.02, 1.04), Vec3(0.76, 0.54, 0.04), BoxCovers(w.clay));
  mesh.box(frame, Vec3(0.22, -0.015, 0.3), Vec3(0.28, 0.02, 0.26), BoxCovers(w.black));
  mesh.sphere(frame * place(0.46, -0.025, 0.43), 0.014, Cover(w.brass, Cover::Fit::random, 0.01), 12);
  mesh.cylinder(frame * place(0.36, 0.3, 1.75), 0.075, 0.87, Cover(w.black, Cover::Fit::random, 0.04));
}

}  // namespace photoslam::synthetic
