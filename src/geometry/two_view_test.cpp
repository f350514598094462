// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/two_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "base/random.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera{640, 480, 525, 530, 320, 240};

/// Two views of random points; `flatness` 1 puts all of them on a slanted plane.
struct Views {
  std::vector<Vec3> points;
  std::vector<Vec2> a, b;
  std::vector<double> sigmas;

  Views(const SE3& b_from_a, double flatness, double noise_px, double wrong_share, int count = 300) {
    Random random(11);
    while (static_cast<int>(a.size()) < count) {
      const Vec2 pixel(random.uniform(0, 639), random.uniform(0, 479));
      const Vec3 ray = kCamera.unproject(pixel, 1.0);
      const double plane = 3.0 / (1 - 0.4 * ray.x() - 0.2 * ray.y());
      const double z = flatness * plane + (1 - flatness) * random.uniform(1.5, 6);
      const Vec3 in_b = b_from_a * (z * ray);
      if (in_b.z() < 0.1) continue;
      Vec2 seen = kCamera.project(in_b);
      if (!kCamera.contains(seen)) continue;
      seen += noise_px * Vec2(random.normal(), random.normal());
      if (random.uniform() < wrong_share) seen = {random.uniform(0, 639), random.uniform(0, 479)};
      points.push_back(z * ray);
      a.push_back(pixel + noise_px * Vec2(random.normal(), random.normal()));
      b.push_back(seen);
      sigmas.push_back(1.0);
    }
  }
  TwoViewResult reconstruct() const { return reconstruct_two_views({}, kCamera, a, b, sigmas); }
};

const SE3 kSideways(so3_exp(Vec3(0.02, -0.05, 0.01)), Vec3(-0.3, 0.05, 0.04));
const SE3 kForwards(so3_exp(Vec3(0.01, 0.02, 0.0)), Vec3(0.02, 0.01, -0.5));

double turn_between(const TwoViewMotion& motion, const SE3& truth) {
  return so3_log(motion.b_from_a.rotation * truth.rotation.inverse()).norm();
}

void expect_motion(const TwoViewMotion& motion, const SE3& truth, double tolerance_deg) {
  EXPECT_LT(turn_between(motion, truth) * 180 / std::numbers::pi, tolerance_deg);
  EXPECT_GT(motion.b_from_a.translation.dot(truth.translation.normalized()),
            std::cos(10 * tolerance_deg * std::numbers::pi / 180));
}

void expect_motion(const TwoViewResult& result, const SE3& truth, double tolerance_deg) {
  ASSERT_TRUE(result.success) << result.reason;
  expect_motion(result.motions.front(), truth, tolerance_deg);
}

TEST(TwoView, FitsRecoverExactMatrices) {
  const Views space(kSideways, 0, 0, 0, 20), plane(kSideways, 1, 0, 0, 20);
  std::vector<Vec2> a, b, c, d;
  for (size_t i = 0; i < 20; ++i) {
    a.emplace_back(kCamera.unproject(space.a[i], 1).head<2>());
    b.emplace_back(kCamera.unproject(space.b[i], 1).head<2>());
    c.emplace_back(kCamera.unproject(plane.a[i], 1).head<2>());
    d.emplace_back(kCamera.unproject(plane.b[i], 1).head<2>());
  }
  const Mat3 essential = fit_essential(a, b), homography = fit_homography(c, d);
  for (size_t i = 0; i < 20; ++i) {
    EXPECT_NEAR(b[i].homogeneous().dot(essential * a[i].homogeneous()), 0, 1e-10);
    EXPECT_LT(((homography * c[i].homogeneous()).hnormalized() - d[i]).norm(), 1e-10);
  }
  // One of the motions of either is the true one.
  for (const auto& motions : {motions_from_essential(essential), motions_from_homography(homography)}) {
    EXPECT_EQ(motions.size(), 4u);
    double nearest = 1;
    for (const SE3& motion : motions) {
      const SE3 expected(kSideways.rotation, kSideways.translation.normalized());
      nearest = std::min(nearest, (motion * expected.inverse()).log().norm());
    }
    EXPECT_LT(nearest, 1e-8);
  }
}

TEST(TwoView, ReconstructsWithoutNoise) {
  for (const SE3& motion : {kSideways, kForwards}) {
    const Views views(motion, 0, 0, 0);
    const TwoViewResult result = views.reconstruct();
    expect_motion(result, motion, 1e-4);
    EXPECT_FALSE(result.plane_scores);
    for (size_t i = 0; i < views.points.size(); ++i) {
      if (!result.motions.front().good[i]) continue;
      EXPECT_LT((result.motions.front().points[i] * motion.translation.norm() - views.points[i]).norm(),
                1e-3 * views.points[i].norm());
    }
  }
}

TEST(TwoView, ToleratesNoiseAndWrongMatches) {
  const Views views(kSideways, 0, 0.7, 0.3);
  const TwoViewResult result = views.reconstruct();
  expect_motion(result, kSideways, 0.5);
  int good = 0;
  for (const uint8_t g : result.motions.front().good) good += g;
  EXPECT_GT(good, 180);
}

TEST(TwoView, APlaneIsReconstructedByItsHomography) {
  const SE3 truth(so3_exp(Vec3(0.02, -0.15, 0.01)), Vec3(-0.6, 0.05, 0.2));
  const TwoViewResult result = Views(truth, 1, 0.3, 0.2).reconstruct();
  EXPECT_TRUE(result.plane_scores);
  // Two planes explain what was seen; one of the motions is the true one, and counting does not tell which.
  ASSERT_GE(result.motions.size(), 2u);
  const auto nearest =
      std::ranges::min_element(result.motions, {}, [&](const TwoViewMotion& m) { return turn_between(m, truth); });
  expect_motion(*nearest, truth, 1.0);
}

TEST(TwoView, RefusesAPureRotation) {
  for (const double noise : {0.0, 0.7}) {
    const Views views(SE3(so3_exp(Vec3(0.03, 0.12, -0.02)), Vec3::Zero()), 0, noise, 0.1);
    const TwoViewResult result = views.reconstruct();
    EXPECT_FALSE(result.success);
    EXPECT_FALSE(result.reason.empty());
  }
}

TEST(TwoView, RefusesTooLittleParallax) {
  const Views views(SE3(so3_exp(Vec3(0.02, -0.05, 0.01)), Vec3(-0.02, 0, 0)), 0, 0.5, 0.1);
  EXPECT_FALSE(views.reconstruct().success);
}

TEST(TwoView, RefusesNonsense) {
  Views views(kSideways, 0, 0.5, 1.0);
  EXPECT_FALSE(views.reconstruct().success);
  EXPECT_FALSE(reconstruct_two_views({}, kCamera, {}, {}, {}).success);
}

}  // namespace
}  // namespace photoslam
