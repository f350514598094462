// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "sources/synthetic/furniture/furniture.h"

namespace photoslam::synthetic {
namespace {

// The opening of the window in the east wall: its extent along y and z.
constexpr double kWindowSouth = 1.15, kWindowNorth = 2.75, kWindowSill = 0.9, kWindowHead = 2.25;
constexpr double kReveal = 0.16;  // thickness of the wall

void walls(Workshop& w, const Vec3& size) {
  MeshBuilder& mesh = w.mesh();
  const double x = size.x(), y = size.y(), z = size.z();
  const float fx = static_cast<float>(x), fy = static_cast<float>(y), fz = static_cast<float>(z);
  const SE3 origin;
  const Cover::Fit fill = Cover::Fit::stretch;
  const int floor = w.material(fx, fy, 300, parquet(w.seed()), {.gloss = 0.05f, .roughness = 0.12f});
  const int brick = w.material(fx, fz, 300, brick_wall(w.seed()), {.gloss = 0.01f});
  const int paper = w.material(fy, fz, 300, wallpaper(rgb(0xE2D9C2), w.seed()), {.gloss = 0.01f});
  const int plastered = w.material(2.0f, 2.0f, 220, plaster(rgb(0xC9B592), w.seed()), {.gloss = 0.01f});
  const int south = w.material(fx, fz, 220, plaster(rgb(0x9FAA98), w.seed()), {.gloss = 0.01f});
  const int ceiling = w.material(2.0f, 2.0f, 120, plaster(rgb(0xE9E4DA), w.seed()), {.gloss = 0});

  mesh.rectangle(origin, Vec3(0, y, 0), Vec3(x, 0, 0), Vec3(0, -y, 0), Cover(floor, fill, 0.025));
  mesh.rectangle(origin, Vec3(0, y, z), Vec3(x, 0, 0), Vec3(0, 0, -z), Cover(brick, fill, 0.04));
  mesh.rectangle(origin, Vec3(0, 0, z), Vec3(0, y, 0), Vec3(0, 0, -z), Cover(paper, fill, 0.04));
  mesh.rectangle(origin, Vec3(x, 0, z), Vec3(-x, 0, 0), Vec3(0, 0, -z), Cover(south, fill, 0.04));
  mesh.rectangle(origin, Vec3(0, 0, z), Vec3(x, 0, 0), Vec3(0, y, 0), Cover(ceiling, Cover::Fit::random, 0.06));
  // The east wall leaves the window open.
  const Cover cover(plastered, Cover::Fit::aligned, 0.03);
  const auto east = [&](double north, double south_end, double bottom, double top) {
    mesh.rectangle(origin, Vec3(x, north, top), Vec3(0, south_end - north, 0), Vec3(0, 0, bottom - top), cover);
  };
  east(y, kWindowNorth, 0, z);
  east(kWindowSouth, 0, 0, z);
  east(kWindowNorth, kWindowSouth, 0, kWindowSill);
  east(kWindowNorth, kWindowSouth, kWindowHead, z);
}

void window(Workshop& w, const Vec3& size) {
  MeshBuilder& mesh = w.mesh();
  const SE3 origin;
  const double x = size.x(), width = kWindowNorth - kWindowSouth, height = kWindowHead - kWindowSill;
  const Cover white(w.white, Cover::Fit::random, 0.03);
  // The four sides of the opening, and a board that sticks out below it.
  mesh.box(origin, Vec3(x - 0.12, kWindowSouth - 0.08, kWindowSill - 0.035), Vec3(0.14 + kReveal, width + 0.16, 0.035),
           BoxCovers(Cover(w.oak, Cover::Fit::random, 0.02)));
  mesh.box(origin, Vec3(x, kWindowSouth - 0.05, kWindowHead), Vec3(kReveal, width + 0.1, 0.05), BoxCovers(white));
  mesh.box(origin, Vec3(x, kWindowSouth - 0.05, kWindowSill), Vec3(kReveal, 0.05, height), BoxCovers(white));
  mesh.box(origin, Vec3(x, kWindowNorth, kWindowSill), Vec3(kReveal, 0.05, height), BoxCovers(white));
  // Frame, mullion and glazing bars.
  const double at = x + 0.09;
  const auto bar = [&](double from_y, double to_y, double from_z, double to_z) {
    mesh.box(origin, Vec3(at, from_y, from_z), Vec3(0.045, to_y - from_y, to_z - from_z), BoxCovers(white));
  };
  bar(kWindowSouth, kWindowSouth + 0.06, kWindowSill, kWindowHead);
  bar(kWindowNorth - 0.06, kWindowNorth, kWindowSill, kWindowHead);
  bar(kWindowSouth, kWindowNorth, kWindowSill, kWindowSill + 0.06);
  bar(kWindowSouth, kWindowNorth, kWindowHead - 0.06, kWindowHead);
  const double middle = (kWindowSouth + kWindowNorth) / 2;
  bar(middle - 0.04, middle + 0.04, kWindowSill, kWindowHead);
  bar(kWindowSouth, kWindowNorth, 1.75, 1.785);

  w.lights.areas.push_back({.center = Vec3(x + 0.05, middle, (kWindowSill + kWindowHead) / 2).cast<float>(),
                            .half_u = Vec3f(0, static_cast<float>(width / 2), 0),
                            .half_v = Vec3f(0, 0, static_cast<float>(height / 2)),
                            .normal = -Vec3f::UnitX(),
                            .radiance = Color(8.6f, 9.2f, 9.8f, 0)});
  w.lights.sun = {
      .towards = Vec3f(0.80f, -0.20f, 0.60f).normalized(), .radius = 0.02f, .irradiance = Color(9.0f, 7.6f, 5.6f, 0)};
}

void curtains(Workshop& w, const Vec3& size) {
  MeshBuilder& mesh = w.mesh();
  const double x = size.x() - 0.1, top = kWindowHead + 0.14;
  const Cover cloth(w.linen, Cover::Fit::aligned, 0.025);
  const auto drape = [&](double north, double south) {
    mesh.patch(
        SE3(), 60, 12,
        [&](double u, double v) -> Vec3 {
          const double fold = (0.025 + 0.02 * v) * std::sin(44 * u + 1.5 * v) + 0.012 * std::sin(17 * u);
          const double gather = 0.1 * std::sin(std::numbers::pi * v) * (0.5 - u);
          return {x + fold, north + (south - north) * u + gather, top - v * (top - 0.03)};
        },
        cloth);
  };
  drape(kWindowNorth + 0.42, kWindowNorth - 0.06);
  drape(kWindowSouth + 0.06, kWindowSouth - 0.42);
  const Vec3 rod[] = {{x, kWindowNorth + 0.55, top + 0.03}, {x, kWindowSouth - 0.55, top + 0.03}};
  mesh.tube(SE3(), rod, 0.014, Cover(w.brass, Cover::Fit::random, 0.03));
  for (const double y : {kWindowNorth + 0.57, kWindowSouth - 0.57}) {
    mesh.sphere(place(x, y, top + 0.03), 0.028, Cover(w.brass, Cover::Fit::random, 0.02), 16);
  }
}

void radiator(Workshop& w, const Vec3& size) {
  const SE3 frame = place(size.x() - 0.12, (kWindowSouth + kWindowNorth) / 2 + 0.5, 0.14, -90);
  for (int i = 0; i < 14; ++i) {
    w.mesh().rounded_box(frame * place(0.035 + 0.072 * i, 0.04, 0.3), Vec3(0.055, 0.1, 0.58), 0.024, 0,
                         Cover(w.white, Cover::Fit::random, 0.03));
  }
}

void door(Workshop& w, const Vec3& size) {
  // In the south wall, which faces north.
  const SE3 frame = place(size.x() - 0.3, 0.0, 0, 180);
  constexpr double kWidth = 0.86, kHeight = 2.05;
  MeshBuilder& mesh = w.mesh();
  const BoxCovers timber(Cover(w.oak, Cover::Fit::random, 0.03));
  const BoxCovers casing(Cover(w.white, Cover::Fit::random, 0.03));
  mesh.box(frame, Vec3(0, -0.03, 0), Vec3(kWidth, 0.03, kHeight), timber);
  for (const double z : {0.12, 1.12}) {
    for (const double x : {0.1, 0.48})
      mesh.box(frame, Vec3(x, -0.045, z), Vec3(0.28, 0.016, z < 1 ? 0.86 : 0.8), timber);
  }
  mesh.box(frame, Vec3(-0.09, -0.05, 0), Vec3(0.09, 0.05, kHeight + 0.09), casing);
  mesh.box(frame, Vec3(kWidth, -0.05, 0), Vec3(0.09, 0.05, kHeight + 0.09), casing);
  mesh.box(frame, Vec3(0, -0.05, kHeight), Vec3(kWidth, 0.05, 0.09), casing);
  const Vec3 handle[] = {{kWidth - 0.05, -0.05, 1.02}, {kWidth - 0.05, -0.085, 1.02}, {kWidth - 0.17, -0.085, 1.015}};
  mesh.tube(frame, handle, 0.01, Cover(w.brass, Cover::Fit::random, 0.02));
}

void skirting(Workshop& w, const Vec3& size) {
  const BoxCovers board(Cover(w.white, Cover::Fit::random, 0.04));
  const Vec3 along_x(size.x(), 0.016, 0.1), along_y(0.016, size.y(), 0.1);
  w.mesh().box(SE3(), Vec3(0, size.y() - 0.016, 0), along_x, board);
  w.mesh().box(SE3(), Vec3(0, 0, 0), along_x, board);
  w.mesh().box(SE3(), Vec3(0, 0, 0), along_y, board);
  w.mesh().box(SE3(), Vec3(size.x() - 0.016, 0, 0), along_y, board);
}

void ceiling_beams(Workshop& w, const Vec3& size) {
  for (const double x : {0.95, 2.45, 3.95}) {
    w.mesh().box(SE3(), Vec3(x, 0, size.z() - 0.13), Vec3(0.14, size.y(), 0.13),
                 BoxCovers(Cover(w.walnut, Cover::Fit::random, 0.05)));
  }
}

}  // namespace

void pendant_lamp(Workshop& w, const Vec3& position, double ceiling) {
  const int paper = w.material(0.9f, 0.5f, 300, curtain(rgb(0xFBF3E2), w.seed()), {.gloss = 0, .emission = 0.75f});
  constexpr double kRadius = 0.2;
  w.mesh().sphere(place(position.x(), position.y(), position.z()), kRadius, Cover(paper, Cover::Fit::stretch, 0.05),
                  32);
  const Vec3 wire[] = {{position.x(), position.y(), ceiling}, {position.x(), position.y(), position.z() + kRadius}};
  w.mesh().tube(SE3(), wire, 0.004, Cover(w.black, Cover::Fit::random, 0.1), 6);
  w.lights.areas.push_back({.center = position.cast<float>(),
                            .radius = static_cast<float>(kRadius),
                            .radiance = Color(9.5f, 8.1f, 6.0f, 0)});
}

void shell(Workshop& w, const Vec3& size) {
  walls(w, size);
  window(w, size);
  curtains(w, size);
  radiator(w, size);
  door(w, size);
  skirting(w, size);
  ceiling_beams(w, size);
  pendant_lamp(w, Vec3(1.75, 1.9, 2.13), size.z());
}

}  // namespace photoslam::synthetic
