// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "sources/synthetic/furniture/furniture.h"

namespace photoslam::synthetic {
namespace {

SE3 tilt(double roll_deg) { return {so3_exp(Vec3(0, roll_deg * std::numbers::pi / 180, 0)), Vec3::Zero()}; }

/// Fills a shelf board of the given clear width and height with books, and here and there with something else.
void fill_board(Workshop& w, const SE3& frame, double width, double clear_height, double depth) {
  Random& random = w.random();
  double x = random.uniform(0.005, 0.03);
  while (x < width - 0.06) {
    const double choice = random.uniform();
    const double rest = width - x;
    if (choice < 0.035 && rest > 0.3) {
      const int count = 3 + random.index(3);
      book_pile(w, frame * place(x + 0.13, 0.13, 0, 90 + random.uniform(-6, 6)), count);
      if (random.uniform() < 0.5)
        mug(w, frame * place(x + 0.13, 0.13, 0.045 * count), hue(static_cast<float>(random.uniform()), 0.5f, 0.75f));
      x += 0.28;
    } else if (choice < 0.065 && rest > 0.22) {
      vase(w, frame * place(x + 0.09, 0.14, 0), std::min(0.2, clear_height - 0.03), false);
      x += 0.19;
    } else if (choice < 0.085 && rest > 0.26) {
      candles(w, frame * place(x + 0.11, 0.13, 0));
      x += 0.22;
    } else {
      const double thickness = random.uniform(0.014, 0.05);
      const double height = std::min(random.uniform(0.17, 0.29), clear_height - 0.012);
      const double book_depth = std::min(random.uniform(0.55, 0.75) * height + 0.02, depth - 0.04);
      const double inset = random.uniform(0.008, 0.035);
      // The last of a row leans on the others.
      const bool leans = random.uniform() < 0.06 && rest > 0.2;
      if (leans) {
        const double angle = random.uniform(-14, -7), run = height * std::sin(-angle * std::numbers::pi / 180);
        book(w, frame * place(x + run, inset, 0.001) * tilt(angle), thickness, book_depth, height, BookPose::upright);
        x += run + thickness + 0.012;
      } else {
        book(w, frame * place(x, inset, 0), thickness, book_depth, height, BookPose::upright);
        x += thickness + 0.0008 + (random.uniform() < 0.03 ? random.uniform(0.02, 0.06) : 0.0);
      }
    }
  }
}

}  // namespace

void book(Workshop& w, const SE3& frame, double thickness, double depth, double height, BookPose pose) {
  const float t = static_cast<float>(thickness), d = static_cast<float>(depth), h = static_cast<float>(height);
  const uint32_t seed = w.seed();
  const bool lying = pose == BookPose::lying;
  const Finish finish{.gloss = w.random().uniform() < 0.4 ? 0.05f : 0.015f, .roughness = 0.25f};
  const Cover spine(w.material(t, h, 450, book_spine(t, h, seed), finish), Cover::Fit::stretch, 0.05);
  const Cover cover(w.material(d, h, lying ? 900 : 250, book_cover(d, h, seed), finish), Cover::Fit::stretch,
                    lying ? 0.02 : 0.08);
  const Cover paper(w.pages, Cover::Fit::random, 0.06);
  // Built upright: spine in front, cover at the left.
  const SE3 laid(so3_exp(Vec3(0, std::numbers::pi / 2, 0)), Vec3(-height / 2, -depth / 2, thickness));
  const SE3 book_frame = lying ? frame * laid : frame;
  MeshBuilder& mesh = w.mesh();
  const double board = std::min(0.0025, 0.15 * thickness), rim = 0.003;
  mesh.patch(
      book_frame, 5, 2,
      [&](double u, double v) -> Vec3 {
        return {u * thickness, 0.1 * thickness * (2 * u - 1) * (2 * u - 1) - 0.1 * thickness, (1 - v) * height};
      },
      spine);
  mesh.box(book_frame, Vec3(0, 0, 0), Vec3(board, depth, height), BoxCovers(cover));
  mesh.box(book_frame, Vec3(thickness - board, 0, 0), Vec3(board, depth, height), BoxCovers(cover));
  mesh.box(book_frame, Vec3(board, 0, rim), Vec3(thickness - 2 * board, depth - rim, height - 2 * rim),
           BoxCovers(paper));
}

void book_pile(Workshop& w, const SE3& frame, int count) {
  double z = 0;
  for (int i = 0; i < count; ++i) {
    const double thickness = w.random().uniform(0.02, 0.045);
    const double shrink = 1 - 0.06 * i;
    book(w,
         frame * place(w.random().uniform(-0.012, 0.012), w.random().uniform(-0.012, 0.012), z,
                       w.random().uniform(-14, 14)),
         thickness, w.random().uniform(0.15, 0.19) * shrink, w.random().uniform(0.21, 0.27) * shrink, BookPose::lying);
    z += thickness + 0.0005;
  }
}

void bookshelf(Workshop& w, const SE3& frame, double width, double height, int boards) {
  constexpr double kDepth = 0.31, kBoard = 0.022;
  MeshBuilder& mesh = w.mesh();
  const BoxCovers timber(Cover(w.walnut, Cover::Fit::random, 0.03));
  mesh.box(frame, Vec3(0, 0, 0), Vec3(kBoard, kDepth, height), timber);
  mesh.box(frame, Vec3(width - kBoard, 0, 0), Vec3(kBoard, kDepth, height), timber);
  mesh.rectangle(frame, Vec3(0, kDepth, height), Vec3(width, 0, 0), Vec3(0, 0, -height),
                 Cover(w.walnut, Cover::Fit::random, 0.04));
  const double pitch = (height - 0.08 - kBoard) / (boards - 1);
  const double middle = 0.52 * width;
  for (int i = 0; i < boards; ++i) {
    const double z = 0.08 + i * pitch;
    mesh.box(frame, Vec3(kBoard, 0.004, z), Vec3(width - 2 * kBoard, kDepth - 0.006, kBoard), timber);
    if (i + 1 == boards) break;
    const double clear = pitch - kBoard;
    mesh.box(frame, Vec3(middle, 0.008, z + kBoard), Vec3(kBoard, kDepth - 0.01, clear), timber);
    fill_board(w, frame * place(kBoard, 0.01, z + kBoard), middle - kBoard, clear, kDepth - 0.02);
    fill_board(w, frame * place(middle + kBoard, 0.01, z + kBoard), width - middle - 2 * kBoard, clear, kDepth - 0.02);
  }
  wicker_basket(w, frame * place(0.2 * width, 0.16, height + 0.001), 0.14, 0.2);
  potted_plant(w, frame * place(0.72 * width, 0.16, height), 0.13, 0.3, 16);
  book_pile(w, frame * place(0.45 * width, 0.15, height, 10), 4);
}

}  // namespace photoslam::synthetic
