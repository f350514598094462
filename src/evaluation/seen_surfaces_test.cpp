// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/seen_surfaces.h"

#include <gtest/gtest.h>

namespace photoslam {
namespace {

constexpr int kWidth = 160, kHeight = 120;
const PinholeCamera kCamera{kWidth, kHeight, 100, 100, 79.5, 59.5};
constexpr double kUnit = 0.001;
const ImageU16 kWallAtTwoMetres(kWidth, kHeight, 1, 2000);

int count(const ImageU8& mask) { return static_cast<int>(std::ranges::count(mask.values(), 255)); }

TEST(SeenSurfaces, AViewHasSeenAllItShows) {
  SeenSurfaces seen(kCamera, kUnit);
  EXPECT_EQ(count(seen.mask({}, kWallAtTwoMetres)), 0);
  seen.add_view({}, kWallAtTwoMetres);
  EXPECT_EQ(count(seen.mask({}, kWallAtTwoMetres)), kWidth * kHeight);
}

TEST(SeenSurfaces, StepAsideUncoversAStripOfTheWall) {
  SeenSurfaces seen(kCamera, kUnit);
  seen.add_view({}, kWallAtTwoMetres);
  // One metre to the right at a distance of two metres: the wall moves by 50 pixels to the left.
  const SE3 aside(Quat::Identity(), Vec3(-1, 0, 0));
  const ImageU8 mask = seen.mask(aside, kWallAtTwoMetres);
  for (int x = 0; x < kWidth; ++x) {
    if (std::abs(x - (kWidth - 50)) < 2 * SeenSurfaces::kStep) continue;
    EXPECT_EQ(mask(x, kHeight / 2), x < kWidth - 50 ? 255 : 0) << x;
  }
}

TEST(SeenSurfaces, WhatStoodBehindSomethingWasNotSeen) {
  ImageU16 with_board = kWallAtTwoMetres;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 40; x < 80; ++x) with_board(x, y) = 1000;
  }
  SeenSurfaces seen(kCamera, kUnit);
  seen.add_view({}, with_board);
  const ImageU8 mask = seen.mask({}, kWallAtTwoMetres);
  EXPECT_EQ(mask(60, 60), 0);
  EXPECT_EQ(mask(20, 60), 255);
  EXPECT_EQ(count(seen.mask({}, ImageU16(kWidth, kHeight, 1, 0))), 0) << "nothing is known of pixels without depth";
}

}  // namespace
}  // namespace photoslam
