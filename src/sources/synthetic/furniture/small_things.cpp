// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "sources/synthetic/furniture/furniture.h"

namespace photoslam::synthetic {
namespace {

const Finish kGlazed{.gloss = 0.06f, .roughness = 0.1f};

Cover fine(int material) { return {material, Cover::Fit::random, 0.012}; }

int pottery(Workshop& w, const Color& ground, const Color& paint, double height) {
  const float h = static_cast<float>(height);
  return w.material(std::max(0.2f, 2 * h), h, 500, glaze(ground, paint, h, w.seed()), kGlazed);
}

}  // namespace

void vase(Workshop& w, const SE3& frame, double height, bool with_flowers) {
  const Color grounds[] = {rgb(0xE9E2D2), rgb(0x2E5266), rgb(0xC9A66B), rgb(0x7B8F6A)};
  const Color paints[] = {rgb(0x28518A), rgb(0xE8DCC0), rgb(0x5A2E22), rgb(0x26302A)};
  const int k = w.random().index(4);
  const int clay = pottery(w, grounds[k], paints[k], height);
  const double slim = w.random().uniform(0.2, 0.32);
  std::vector<Vec2> profile;
  for (int i = 0; i <= 18; ++i) {
    const double t = i / 18.0;  // from the lip down
    const double belly = std::exp(-std::pow((t - 0.62) / 0.3, 2.0));
    profile.push_back({height * (0.13 + slim * belly + 0.09 * std::exp(-t * 14)), height * (1 - t)});
  }
  profile.push_back({0, 0});
  w.mesh().lathe(frame, profile, Cover(clay, Cover::Fit::aligned, 0.02), 28);
  const Vec2 inside[] = {{0, 0.9 * height}, {0.15 * height, 0.9 * height}, {0.215 * height, height}};
  w.mesh().lathe(frame, inside, fine(w.black), 20);
  if (!with_flowers) return;
  for (int i = 0; i < 9; ++i) {
    const double angle = 2.4 * i, spread = 0.04 + 0.018 * i, rise = w.random().uniform(0.14, 0.3);
    const Vec3 tip(spread * std::cos(angle), spread * std::sin(angle), height + rise);
    const Vec3 stem[] = {tip, {0.5 * tip.x(), 0.5 * tip.y(), height + 0.4 * rise}, {0, 0, 0.6 * height}};
    w.mesh().tube(frame, stem, 0.003, fine(w.leaf_dark), 6);
    const int petals =
        w.paint(hue(i % 3 == 0 ? 0.02f : (i % 3 == 1 ? 0.13f : 0.94f), 0.6f, 0.9f), {.gloss = 0, .translucency = 0.4f});
    for (int p = 0; p < 7; ++p) {
      const double a = p * 2 * std::numbers::pi / 7;
      w.mesh().leaf(frame * place(tip.x(), tip.y(), tip.z()), Vec3(0.032 * std::cos(a), 0.032 * std::sin(a), 0.018),
                    0.02, 0.004, fine(petals));
    }
    w.mesh().sphere(frame * place(tip.x(), tip.y(), tip.z() + 0.004), 0.008, fine(w.brass), 8);
    w.mesh().leaf(frame * place(stem[1].x(), stem[1].y(), stem[1].z()),
                  Vec3(0.07 * std::cos(angle + 1), 0.07 * std::sin(angle + 1), 0.04), 0.025, 0.03, fine(w.leaf_light));
  }
}

void potted_plant(Workshop& w, const SE3& frame, double pot_height, double leaf_length, int leaves) {
  const Vec2 pot[] = {{0.46 * pot_height, 0.93 * pot_height},
                      {0.46 * pot_height, pot_height},
                      {0.52 * pot_height, pot_height},
                      {0.52 * pot_height, pot_height},
                      {0.52 * pot_height, 0.84 * pot_height},
                      {0.48 * pot_height, 0.84 * pot_height},
                      {0.36 * pot_height, 0},
                      {0, 0}};
  w.mesh().lathe(frame, pot, fine(w.clay), 28);
  const Vec2 soil[] = {{0, 0.94 * pot_height}, {0.46 * pot_height, 0.92 * pot_height}};
  w.mesh().lathe(frame, soil, fine(w.black), 20);
  for (int i = 0; i < leaves; ++i) {
    const double angle = 2.39996 * i, t = (i + 0.5) / leaves;
    const double reach = leaf_length * (0.35 + 0.65 * t), rise = leaf_length * (1.15 - 0.9 * t) + 0.02;
    const Vec3 base(0.1 * pot_height * std::cos(angle), 0.1 * pot_height * std::sin(angle), 0.93 * pot_height);
    const Vec3 knee = base + Vec3(0.25 * reach * std::cos(angle), 0.25 * reach * std::sin(angle), 0.6 * rise);
    const Vec3 stem[] = {knee, base};
    w.mesh().tube(frame, stem, 0.0035, fine(w.leaf_light), 5);
    const Vec3 along(reach * std::cos(angle), reach * std::sin(angle), 0.6 * rise);
    w.mesh().leaf(frame * place(knee.x(), knee.y(), knee.z()), along,
                  0.3 * leaf_length * w.random().uniform(0.75, 1.15), 0.5 * rise + 0.2 * reach,
                  Cover(i % 3 == 0 ? w.leaf_light : w.leaf_dark, Cover::Fit::stretch, 0.025));
  }
}

void mug(Workshop& w, const SE3& frame, const Color& color) {
  const int clay = pottery(w, color, rgb(0xEFE6D4), 0.095);
  const Vec2 profile[] = {{0, 0.012},    {0.032, 0.012}, {0.036, 0.095}, {0.036, 0.095}, {0.04, 0.095},
                          {0.04, 0.095}, {0.04, 0.006},  {0.034, 0},     {0, 0}};
  w.mesh().lathe(frame, profile, Cover(clay, Cover::Fit::aligned, 0.01), 24);
  std::vector<Vec3> handle;
  for (int i = 0; i <= 10; ++i) {
    const double a = std::numbers::pi * (i / 10.0 - 0.5);
    handle.push_back({0.038 + 0.028 * std::cos(a), 0, 0.048 - 0.03 * std::sin(a)});
  }
  w.mesh().tube(frame, handle, 0.0055, fine(clay), 8);
}

void teapot(Workshop& w, const SE3& frame) {
  const int clay = pottery(w, rgb(0xE7E0D0), rgb(0x2C5A8C), 0.15);
  std::vector<Vec2> profile{{0.0, 0.158}, {0.012, 0.155}, {0.014, 0.145}, {0.007, 0.138}};
  for (int i = 0; i <= 16; ++i) {
    const double a = std::numbers::pi * (0.12 + 0.78 * i / 16);
    profile.push_back({0.085 * std::sin(a), 0.067 + 0.067 * std::cos(a)});
  }
  profile.push_back({0, 0});
  w.mesh().lathe(frame, profile, Cover(clay, Cover::Fit::aligned, 0.01), 28);
  const Vec3 spout[] = {{0.155, 0, 0.115}, {0.135, 0, 0.1}, {0.11, 0, 0.065}, {0.07, 0, 0.045}};
  w.mesh().tube(frame, spout, 0.013, fine(clay), 10);
  std::vector<Vec3> handle;
  for (int i = 0; i <= 12; ++i) {
    const double a = std::numbers::pi * (i / 12.0 - 0.5);
    handle.push_back({-0.075 - 0.05 * std::cos(a), 0, 0.07 - 0.042 * std::sin(a)});
  }
  w.mesh().tube(frame, handle, 0.007, fine(clay), 8);
}

void fruit_bowl(Workshop& w, const SE3& frame) {
  const int clay = pottery(w, rgb(0x3F6E73), rgb(0xE6D8B8), 0.08);
  const Vec2 profile[] = {{0, 0.02},      {0.06, 0.025}, {0.11, 0.05},  {0.135, 0.085}, {0.135, 0.085}, {0.142, 0.085},
                          {0.142, 0.085}, {0.115, 0.04}, {0.06, 0.008}, {0.055, 0},     {0, 0}};
  w.mesh().lathe(frame, profile, Cover(clay, Cover::Fit::aligned, 0.01), 32);
  const int apple = w.material(0.25f, 0.15f, 500, fruit(rgb(0xB3302A), rgb(0xC9A83C), w.seed()), kGlazed);
  const int pear = w.material(0.25f, 0.15f, 500, fruit(rgb(0xA9A53A), rgb(0x7F8F35), w.seed()), kGlazed);
  const int orange = w.material(0.25f, 0.15f, 500, fruit(rgb(0xE08A2A), rgb(0xD9742A), w.seed()), kGlazed);
  const int kinds[] = {apple, orange, pear, apple, orange, apple, pear};
  for (int i = 0; i < 7; ++i) {
    const double angle = 1.05 * i, ring = i == 6 ? 0.0 : 0.07;
    w.mesh().sphere(frame * place(ring * std::cos(angle), ring * std::sin(angle), i == 6 ? 0.125 : 0.078),
                    0.037 + 0.004 * w.random().uniform(), fine(kinds[i]), 20);
  }
}

void globe_on_stand(Workshop& w, const SE3& frame) {
  const int map = w.material(0.66f, 0.33f, 500, globe(0.105f, w.seed()), {.gloss = 0.05f, .roughness = 0.15f});
  w.mesh().lathe(frame, std::vector<Vec2>{{0, 0.03}, {0.02, 0.03}, {0.09, 0.01}, {0.09, 0}, {0, 0}}, fine(w.walnut),
                 24);
  const SE3 axis = frame * SE3(so3_exp(Vec3(0, 0.41, 0)), Vec3(0, 0, 0.19));
  w.mesh().sphere(axis, 0.105, Cover(map, Cover::Fit::stretch, 0.015), 36);
  std::vector<Vec3> arc;
  for (int i = 0; i <= 16; ++i) {
    const double a = std::numbers::pi * i / 16;
    arc.push_back({0.12 * std::sin(a), 0, 0.12 * std::cos(a)});
  }
  w.mesh().tube(axis, arc, 0.005, fine(w.brass), 8);
  w.mesh().cylinder(frame * place(0, 0, 0.02), 0.008, 0.065, fine(w.brass), 10);
}

void table_lamp(Workshop& w, const SE3& frame) {
  const int shade = w.material(0.6f, 0.2f, 400, curtain(rgb(0xF0E2C4), w.seed()),
                               {.gloss = 0, .emission = 0.5f, .translucency = 0.5f});
  w.mesh().lathe(
      frame,
      std::vector<Vec2>{
          {0.012, 0.3}, {0.012, 0.2}, {0.03, 0.16}, {0.045, 0.1}, {0.03, 0.05}, {0.075, 0.02}, {0.075, 0}, {0, 0}},
      fine(w.brass), 24);
  const Vec2 cone[] = {{0.075, 0.42}, {0.13, 0.26}}, inside[] = {{0.13, 0.26}, {0.075, 0.42}};
  w.mesh().lathe(frame, cone, Cover(shade, Cover::Fit::stretch, 0.02), 28);
  w.mesh().lathe(frame, inside, Cover(shade, Cover::Fit::stretch, 0.02), 28);
}

void candles(Workshop& w, const SE3& frame) {
  const int wax = w.paint(rgb(0xEFE3C8), {.gloss = 0.04f, .translucency = 0.0f});
  for (int i = 0; i < 3; ++i) {
    const double height = 0.07 + 0.035 * i, x = 0.035 * (i - 1), y = 0.02 * (i % 2);
    w.mesh().cylinder(frame * place(x, y, 0), 0.017, height, fine(wax), 16);
    w.mesh().cylinder(frame * place(x, y, height), 0.0015, 0.01, fine(w.black), 6);
  }
  w.mesh().lathe(frame, std::vector<Vec2>{{0, 0.004}, {0.075, 0.004}, {0.08, 0.01}, {0.08, 0}, {0, 0}}, fine(w.brass),
                 24);
}

void wicker_basket(Workshop& w, const SE3& frame, double radius, double height) {
  const Vec2 profile[] = {{0, 0.02},        {0.8 * radius, 0.02}, {0.95 * radius, height}, {0.95 * radius, height},
                          {radius, height}, {radius, height},     {0.84 * radius, 0},      {0, 0}};
  w.mesh().lathe(frame, profile, Cover(w.wicker, Cover::Fit::aligned, 0.02), 28);
  const int wool[] = {w.paint(rgb(0xB5472F)), w.paint(rgb(0xD8A23F)), w.paint(rgb(0x6E8B74)), w.paint(rgb(0xE4D9C4))};
  for (int i = 0; i < 5; ++i) {
    const double angle = 1.3 * i, ring = i == 4 ? 0 : 0.48 * radius;
    w.mesh().sphere(frame * place(ring * std::cos(angle), ring * std::sin(angle), 0.75 * height), 0.42 * radius,
                    fine(wool[i % 4]), 16);
  }
}

void printed_sheet(Workshop& w, const SE3& frame, double width, double height) {
  const float fw = static_cast<float>(width), fh = static_cast<float>(height);
  const int page = w.material(fw, fh, 700, printed_page(fw, fh, w.seed()), {.gloss = 0.02f});
  w.mesh().patch(
      frame, 5, 5,
      [&](double u, double v) -> Vec3 {
        const double curl = 0.006 * std::pow(std::abs(2 * u - 1), 3.0) * v;
        return {(u - 0.5) * width, (0.5 - v) * height, curl};
      },
      Cover(page, Cover::Fit::stretch, 0.0125));
}

}  // namespace photoslam::synthetic
