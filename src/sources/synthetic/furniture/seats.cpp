// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <span>

#include "sources/synthetic/furniture/furniture.h"

namespace photoslam::synthetic {
namespace {

/// A block given by its lower left front corner.
void padded_block(Workshop& w, const SE3& frame, const Vec3& corner, const Vec3& size, double radius, double bulge,
                  int cover) {
  const Vec3 center = corner + size / 2;
  w.mesh().rounded_box(frame * place(center.x(), center.y(), center.z()), size, radius, bulge,
                       Cover(cover, Cover::Fit::random, 0.025));
}

void legs(Workshop& w, const SE3& frame, const Vec3& size, double inset, int material, double radius = 0.02) {
  const Vec2 profile[] = {{radius, size.z()}, {0.6 * radius, 0}};
  for (const double x : {inset, size.x() - inset}) {
    for (const double y : {inset, size.y() - inset}) {
      w.mesh().lathe(frame * place(x, y, 0), profile, Cover(material, Cover::Fit::random, 0.02), 12);
    }
  }
}

void throw_pillow(Workshop& w, const SE3& frame, double size, double lean_deg, int cover) {
  const SE3 leaning(so3_exp(Vec3(lean_deg * 0.0174533, 0, 0)), Vec3(0, 0, size / 2));
  w.mesh().pillow(frame * leaning, Vec3(size, 0.19, size), Cover(cover, Cover::Fit::aligned, 0.02));
}

/// The point at the share t of a polyline's length.
Vec2 along(std::span<const Vec2> path, double t) {
  double length = 0;
  for (size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
  double rest = t * length;
  for (size_t i = 1; i < path.size(); ++i) {
    const double step = (path[i] - path[i - 1]).norm();
    if (rest <= step) return path[i - 1] + rest / step * (path[i] - path[i - 1]);
    rest -= step;
  }
  return path.back();
}

/// A knitted blanket that hangs over a sofa's back, down to the seat and over its edge.
void blanket(Workshop& w, const SE3& frame, double sofa_depth, double seat) {
  const int wool = w.material(0.7f, 1.7f, 450, knit(rgb(0xB0603C), w.seed()), {.gloss = 0.004f});
  const Vec2 profile[] = {{sofa_depth + 0.015, 0.5},       {sofa_depth + 0.015, 0.84},
                          {sofa_depth - 0.01, 0.865},      {sofa_depth - 0.42, 0.865},
                          {sofa_depth - 0.455, 0.835},     {sofa_depth - 0.465, seat + 0.06},
                          {sofa_depth - 0.5, seat + 0.04}, {0.03, seat + 0.035},
                          {-0.02, seat + 0.015},           {-0.03, seat - 0.1}};
  const auto surface = [&](double u, double v) -> Vec3 {
    const double skew = 0.03 * std::sin(5 * v) + 0.05 * v, ripple = 0.006 * std::sin(19 * u + 7 * v);
    const Vec2 yz = along(profile, v * (0.94 + 0.06 * u));
    return {0.5 * u + skew, yz.x() + ripple, yz.y() + ripple};
  };
  w.mesh().patch(frame, 14, 60, surface, Cover(wool, Cover::Fit::aligned, 0.02));
}

}  // namespace

void sofa(Workshop& w, const SE3& frame, double width) {
  const int cloth = w.material(1.3f, 1.3f, 450, tweed(rgb(0x4C6270), rgb(0x9FB0AE), w.seed()), {.gloss = 0.008f});
  constexpr double kDepth = 0.92, kArm = 0.2, kLeg = 0.13, kSeat = 0.44;
  legs(w, frame, Vec3(width, kDepth, kLeg), 0.08, w.walnut, 0.025);
  padded_block(w, frame, Vec3(0.02, 0.02, kLeg), Vec3(width - 0.04, kDepth - 0.04, 0.17), 0.03, 0, cloth);
  padded_block(w, frame, Vec3(0, 0, kLeg), Vec3(kArm, kDepth, 0.5), 0.07, 0.01, cloth);
  padded_block(w, frame, Vec3(width - kArm, 0, kLeg), Vec3(kArm, kDepth, 0.5), 0.07, 0.01, cloth);
  padded_block(w, frame, Vec3(kArm, kDepth - 0.24, kLeg), Vec3(width - 2 * kArm, 0.24, 0.68), 0.08, 0.01, cloth);
  const double seat_width = (width - 2 * kArm) / 2;
  for (int i = 0; i < 2; ++i) {
    const double x = kArm + i * seat_width;
    padded_block(w, frame, Vec3(x + 0.004, 0.0, 0.29), Vec3(seat_width - 0.008, kDepth - 0.26, kSeat - 0.29), 0.045,
                 0.02, cloth);
    padded_block(w, frame, Vec3(x + 0.006, kDepth - 0.4, kSeat), Vec3(seat_width - 0.012, 0.2, 0.36), 0.07, 0.03,
                 cloth);
  }
  const int striped = w.material(0.5f, 0.5f, 500, stripes(w.seed()), {.gloss = 0.005f});
  const int dyed = w.material(0.5f, 0.5f, 500, ikat(w.seed()), {.gloss = 0.005f});
  const int flowered = w.material(0.5f, 0.5f, 500, flowers(w.seed()), {.gloss = 0.005f});
  throw_pillow(w, frame * place(kArm + 0.2, 0.42, kSeat, 24), 0.44, -18, striped);
  throw_pillow(w, frame * place(kArm + 0.52, 0.4, kSeat, -6), 0.4, -22, dyed);
  throw_pillow(w, frame * place(width - kArm - 0.25, 0.42, kSeat, -20), 0.45, -18, flowered);
  blanket(w, frame * place(0.5 * width - 0.02, 0, 0), kDepth, kSeat);
}

void armchair(Workshop& w, const SE3& frame) {
  const int hide = w.material(1.0f, 1.0f, 450, leather(rgb(0x9A5B33), w.seed()), {.gloss = 0.05f, .roughness = 0.2f});
  constexpr double kWidth = 0.78, kDepth = 0.8;
  legs(w, frame, Vec3(kWidth, kDepth, 0.15), 0.08, w.oak, 0.022);
  padded_block(w, frame, Vec3(0.0, 0.0, 0.15), Vec3(kWidth, kDepth, 0.16), 0.04, 0, hide);
  padded_block(w, frame, Vec3(0, 0, 0.28), Vec3(0.14, kDepth, 0.32), 0.06, 0.01, hide);
  padded_block(w, frame, Vec3(kWidth - 0.14, 0, 0.28), Vec3(0.14, kDepth, 0.32), 0.06, 0.01, hide);
  padded_block(w, frame, Vec3(0.14, -0.02, 0.3), Vec3(kWidth - 0.28, kDepth - 0.16, 0.15), 0.05, 0.025, hide);
  const SE3 back = frame * SE3(so3_exp(Vec3(-0.2, 0, 0)), Vec3(kWidth / 2, kDepth - 0.1, 0.62));
  w.mesh().rounded_box(back, Vec3(kWidth - 0.2, 0.17, 0.66), 0.07, 0.02, Cover(hide, Cover::Fit::random, 0.025));
  const int cover = w.material(0.5f, 0.5f, 500, ikat(w.seed()), {.gloss = 0.005f});
  throw_pillow(w, frame * place(0.4, 0.44, 0.45, 8), 0.4, -20, cover);
}

void wooden_chair(Workshop& w, const SE3& frame, int seat_cover) {
  constexpr double kWidth = 0.44, kDepth = 0.44, kSeat = 0.45;
  MeshBuilder& mesh = w.mesh();
  const Cover timber(w.birch, Cover::Fit::random, 0.025);
  mesh.rounded_box(frame * place(kWidth / 2, kDepth / 2, kSeat - 0.015), Vec3(kWidth, kDepth, 0.035), 0.015, 0, timber);
  padded_block(w, frame, Vec3(0.02, 0.02, kSeat), Vec3(kWidth - 0.04, kDepth - 0.05, 0.045), 0.02, 0.012, seat_cover);
  for (const double x : {0.035, kWidth - 0.035}) {
    const Vec3 front[] = {{x, 0.04, kSeat - 0.03}, {x, 0.02, 0}};
    const Vec3 back[] = {
        {x, kDepth + 0.06, 0.9}, {x, kDepth, kSeat + 0.1}, {x, kDepth - 0.03, kSeat}, {x, kDepth + 0.02, 0}};
    mesh.tube(frame, front, 0.018, timber);
    mesh.tube(frame, back, 0.018, timber);
    const Vec3 rail[] = {{x, 0.03, 0.2}, {x, kDepth, 0.2}};
    mesh.tube(frame, rail, 0.011, timber);
  }
  for (int i = 0; i < 3; ++i) {
    const double z = 0.6 + 0.12 * i;
    mesh.patch(
        frame, 9, 2,
        [&](double u, double v) -> Vec3 {
          return {0.03 + u * (kWidth - 0.06), kDepth - 0.005 + 0.13 * (z - kSeat) + 0.09 * u * (1 - u),
                  z + 0.035 - 0.07 * v};
        },
        timber);
    mesh.patch(
        frame, 9, 2,
        [&](double u, double v) -> Vec3 {
          const double s = 1 - u;
          return {0.03 + s * (kWidth - 0.06), kDepth + 0.007 + 0.13 * (z - kSeat) + 0.09 * s * (1 - s),
                  z + 0.035 - 0.07 * v};
        },
        timber);
  }
}

}  // namespace photoslam::synthetic
