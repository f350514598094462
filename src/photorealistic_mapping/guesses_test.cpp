// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/guesses.h"

#include <gtest/gtest.h>

#include <vector>

#include "math/se3.h"

namespace photoslam {
namespace {

/// A wall 2 m before a camera that stands 1 m to the right of the second of two anchors and looks half a radian farther
/// to the left; its depth is measured in the left half of the picture.
class Guesses : public ::testing::Test {
 protected:
  Guesses() {
    view.camera = {64, 48, 60, 60, 31.5, 23.5};
    view.depth = ImageF(64, 48);
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 32; ++x) view.depth(x, y) = 2.0f;
    }
    for (int i = 0; i < 2; ++i) model.add_anchor();
    const Mat3 rotation = camera_from_second.matrix3();
    for (int i = 0; i < 9; ++i) camera_from_anchor[1].rotation[i] = rotation(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) camera_from_anchor[1].translation[i] = camera_from_second.translation[i];
  }

  /// Of the second anchor, at a pixel of the camera and so far before it.
  size_t add(double x, double y, double depth, uint32_t tag = kGuessTag) {
    const Vec3 p = camera_from_second.inverse() * view.camera.unproject(Vec2(x, y), depth);
    splatting::Gaussian g;
    for (int i = 0; i < 3; ++i) g.mean[i] = static_cast<float>(p[i]);
    return model.add(1, {&g, 1}, tag).front();
  }
  size_t settle(double tolerance = 0.1) { return settle_guesses(view, camera_from_anchor, 0.1, tolerance, model); }

  DepthPicture view;
  SE3 camera_from_second{Quat(so3_exp(Vec3(0, 0.5, 0))), Vec3(-1, 0, 0)};
  std::vector<splatting::Pose> camera_from_anchor{2};
  splatting::GaussianModel model;
};

TEST_F(Guesses, GoWhenTheyHideTheSurface) {
  add(10, 20, 1.7);
  add(20, 20, 1.7);
  EXPECT_EQ(settle(), 2u);
  EXPECT_TRUE(model.empty());
}

TEST_F(Guesses, ThatWereRightAreGuessesNoMore) {
  const size_t on_the_wall = add(10, 20, 1.85);
  EXPECT_EQ(settle(), 0u);
  EXPECT_EQ(model.tag(on_the_wall), 0u);
}

TEST_F(Guesses, StayWhereNothingIsKnownOfThem) {
  const std::vector<size_t> unsettled{add(10, 20, 2.5), add(50, 20, 1.0), add(-40, 20, 1.0), add(10, 20, -1.0)};
  EXPECT_EQ(settle(), 0u);
  for (const size_t i : unsettled) EXPECT_EQ(model.tag(i), kGuessTag);
}

TEST_F(Guesses, AreAllThatIsTouched) {
  add(10, 20, 1.0, 0);
  EXPECT_EQ(settle(), 0u);
  EXPECT_EQ(model.size(), 1u);
}

TEST_F(Guesses, AreKeptWithoutDepthOrTolerance) {
  add(10, 20, 1.0);
  EXPECT_EQ(settle(0), 0u);
  view.depth = {};
  EXPECT_EQ(settle(), 0u);
  EXPECT_EQ(model.size(), 1u);
}

}  // namespace
}  // namespace photoslam
