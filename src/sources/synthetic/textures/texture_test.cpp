// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/textures/texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sources/synthetic/textures/shaders.h"

namespace photoslam::synthetic {
namespace {

TEST(Texture, IsLinearBetweenTexelCentresAndMirrorsBeyondTheEdges) {
  SerialExecutor serial;
  const Texture ramp = Texture::paint(1, 1, 16, [](float x, float) { return Color(x, 1, 0, 0.5f); }, serial);
  for (float x : {0.1f, 0.25f, 0.5f, 0.81f}) {
    const Color c = ramp.sample(x, 0.4f, 0.01f);
    EXPECT_NEAR(std::sqrt(c[0]), x, 0.006f);
    EXPECT_NEAR(c[1], 1, 1e-5f);
    EXPECT_NEAR(c[3], 0.5f, 0.003f);
    EXPECT_NEAR(ramp.sample(2 - x, 0.4f, 0.01f)[0], c[0], 1e-5f);
    EXPECT_NEAR(ramp.sample(x - 2, 0.4f, 0.01f)[0], c[0], 1e-5f);
  }
}

TEST(Texture, WideFootprintsGiveTheMeanLight) {
  SerialExecutor serial;
  // Half black, half white: on average half the light is reflected, whatever the encoding of the texels.
  const auto checkers = [](float x, float y) {
    const bool white = (static_cast<int>(x * 64) + static_cast<int>(y * 64)) % 2 == 0;
    return Color(white, white, white, 1);
  };
  const Texture texture = Texture::paint(1, 1, 64, checkers, serial);
  EXPECT_NEAR(texture.sample(0.3f, 0.7f, 0.5f)[0], 0.5f, 0.01f);
  EXPECT_NEAR(texture.sample(0.3f, 0.7f, 100.0f)[1], 0.5f, 0.01f);
}

TEST(Texture, PaintsTheSameAtAnyThreadCount) {
  SerialExecutor serial;
  ThreadPool pool(3);
  const Texture one = Texture::paint(0.5f, 0.7f, 100, brick_wall(3), serial);
  const Texture two = Texture::paint(0.5f, 0.7f, 100, brick_wall(3), pool);
  for (float y = 0; y < 0.7f; y += 0.013f) {
    EXPECT_TRUE((one.sample(0.7f * y, y, 0.002f) == two.sample(0.7f * y, y, 0.002f)).all());
  }
}

}  // namespace
}  // namespace photoslam::synthetic
