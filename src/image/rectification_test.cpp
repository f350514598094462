// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/rectification.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/random.h"
#include "image/undistort.h"

namespace photoslam {
namespace {

/// A rig of wide-angle cameras that squint, with different focal lengths, like a real one.
struct Rig {
  CalibratedCamera left{.camera = {752, 480, 458.654, 457.296, 367.215, 248.375},
                        .distortion = {.k1 = -0.28340811, .k2 = 0.07395907, .p1 = 0.00019359, .p2 = 1.76187114e-05}};
  CalibratedCamera right{.camera = {752, 480, 457.587, 456.134, 379.999, 255.238},
                         .distortion = {.k1 = -0.28368365, .k2 = 0.07451284, .p1 = -0.00010473, .p2 = -3.55590700e-05}};
  SE3 right_from_left{so3_exp(Vec3(0.02, -0.03, 0.015)), Vec3(-0.11, 0.004, -0.003)};
};

/// Pixel at which a raw camera sees a point.
Vec2 see(const CalibratedCamera& lens, const Vec3& x) {
  const Vec2 bent = distort(lens.distortion, x.head<2>() / x.z());
  return {lens.camera.fx * bent.x() + lens.camera.cx, lens.camera.fy * bent.y() + lens.camera.cy};
}

/// An image that is bright at one place.
ImageU8 blob(const PinholeCamera& camera, const Vec2& at) {
  ImageU8 image(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      image(x, y) = static_cast<uint8_t>(255 * std::exp(-0.5 * (Vec2(x, y) - at).squaredNorm() / 9));
    }
  }
  return image;
}

Vec2 centroid(const ImageU8& image) {
  Vec2 sum = Vec2::Zero();
  double weight = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      sum += image(x, y) * Vec2(x, y);
      weight += image(x, y);
    }
  }
  return sum / weight;
}

TEST(Rectification, PointsLieInTheSameRowAtTheDisparityOfTheirDepth) {
  const Rig rig;
  const StereoRectification r = rectify_stereo(rig.left, rig.right, rig.right_from_left);
  EXPECT_FALSE(r.is_identity);
  EXPECT_NEAR(r.baseline_m, rig.right_from_left.translation.norm(), 1e-12);
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Vec3 point(random.uniform(-2, 2), random.uniform(-1.5, 1.5), random.uniform(1, 20));
    const Vec3 in_left = r.rectified_from_left * point;
    const Vec3 in_right = r.rectified_from_right * (rig.right_from_left * point);
    const Vec2 a = r.camera.project(in_left), b = r.camera.project(in_right);
    EXPECT_NEAR(a.y(), b.y(), 1e-9);
    EXPECT_NEAR(a.x() - b.x(), r.camera.fx * r.baseline_m / in_left.z(), 1e-9);
  }
}

TEST(Rectification, ResampledImagesShowPointsWhereTheRectifiedCamerasSeeThem) {
  const Rig rig;
  const StereoRectification r = rectify_stereo(rig.left, rig.right, rig.right_from_left);
  const Undistorter left(rig.left.camera, rig.left.distortion, r.camera, r.rectified_from_left);
  const Undistorter right(rig.right.camera, rig.right.distortion, r.camera, r.rectified_from_right);
  for (const Vec3& point : {Vec3(0, 0, 2), Vec3(-0.7, 0.4, 2), Vec3(0.9, -0.5, 2.5)}) {
    const Vec3 in_right = rig.right_from_left * point;
    const Vec2 a = centroid(left.color(blob(rig.left.camera, see(rig.left, point))));
    const Vec2 b = centroid(right.color(blob(rig.right.camera, see(rig.right, in_right))));
    // Stretching by the lens shifts the centroid of a blob a little.
    EXPECT_LT((a - r.camera.project(r.rectified_from_left * point)).norm(), 0.2);
    EXPECT_LT((b - r.camera.project(r.rectified_from_right * in_right)).norm(), 0.2);
  }
  // Both see nearly all of the common image.
  const auto mask = left.mask().values();
  EXPECT_GT(std::ranges::count(mask, 255), static_cast<ptrdiff_t>(mask.size() * 9 / 10));
}

TEST(Rectification, RectifiedImagesAreLeftAlone) {
  const CalibratedCamera camera{.camera = {1226, 370, 707.0912, 707.0912, 601.8873, 183.1104}, .distortion = {}};
  const StereoRectification r = rectify_stereo(camera, camera, SE3(Quat::Identity(), Vec3(-0.537, 0, 0)));
  EXPECT_TRUE(r.is_identity);
  EXPECT_EQ(r.camera, camera.camera);
  EXPECT_DOUBLE_EQ(r.baseline_m, 0.537);
  EXPECT_FALSE(rectify_stereo(camera, camera, SE3(so3_exp(Vec3(0, 0.01, 0)), Vec3(-0.537, 0, 0))).is_identity);
}

TEST(Rectification, RectificationOfARectifiedPairIsTheIdentity) {
  // The same pair, but with a lens so weak that it must be resampled.
  CalibratedCamera camera{.camera = {640, 480, 500, 500, 319.5, 239.5}, .distortion = {.k1 = 1e-9}};
  const StereoRectification r = rectify_stereo(camera, camera, SE3(Quat::Identity(), Vec3(-0.1, 0, 0)));
  EXPECT_FALSE(r.is_identity);
  EXPECT_LT(so3_log(r.rectified_from_left).norm(), 1e-12);
  EXPECT_NEAR(r.camera.cx, 319.5, 1e-3);
  EXPECT_NEAR(r.camera.cy, 239.5, 1e-3);
}

}  // namespace
}  // namespace photoslam
