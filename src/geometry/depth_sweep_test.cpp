// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/depth_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/testing/textured_wall.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {160, 120, 140, 140, 83, 57};

using Scene = photoslam::testing::TexturedWall;

const SE3 kReference;
const DepthRange kRange = {1.2, 30.0};

SE3 moved(const Vec3& translation, const Vec3& rotation = Vec3::Zero()) {
  SE3 pose;
  pose.translation = translation;
  if (rotation.norm() > 0) pose.rotation = Quat(Eigen::AngleAxisd(rotation.norm(), rotation.normalized()));
  return pose;
}

struct Accuracy {
  double share = 0;         // of pixels with a depth, borders excluded
  double median_error = 0;  // relative
  double wrong = 0;         // share of those that are off by more than 10 %
};

Accuracy compare(const Scene& scene, const ImageF& depth) {
  constexpr int kBorder = 8;
  std::vector<double> errors;
  int pixels = 0, wrong = 0;
  for (int y = kBorder; y < depth.height() - kBorder; ++y) {
    for (int x = 24; x < depth.width() - 24; ++x) {
      ++pixels;
      if (!(depth(x, y) > 0)) continue;
      const double truth = scene.look(kCamera, kReference, x, y).depth;
      errors.push_back(std::abs(static_cast<double>(depth(x, y)) / truth - 1));
      if (errors.back() > 0.1) ++wrong;
    }
  }
  if (errors.empty()) return {};
  std::ranges::sort(errors);
  return {static_cast<double>(errors.size()) / pixels, errors[errors.size() / 2],
          static_cast<double>(wrong) / static_cast<double>(errors.size())};
}

ImageF sweep(const Scene& scene, const std::vector<SE3>& poses, double gain, Executor& executor) {
  std::vector<ImageU8> pictures;
  for (const SE3& pose : poses) pictures.push_back(scene.picture(kCamera, pose, gain));
  std::vector<SweepView> views;
  for (size_t i = 0; i < poses.size(); ++i) views.push_back({&pictures[i], kCamera, poses[i]});
  return sweep_depth({}, scene.picture(kCamera, kReference), kCamera, views, kRange, executor);
}

class DepthSweep : public ::testing::Test {
 protected:
  SerialExecutor serial_;
};

TEST_F(DepthSweep, FindsASlantedWallFromAStereoPair) {
  const Scene scene;
  const Accuracy accuracy = compare(scene, sweep(scene, {moved({-0.2, 0, 0})}, 1.0, serial_));
  EXPECT_GT(accuracy.share, 0.9);
  EXPECT_LT(accuracy.wrong, 0.01);
  // 140 * 0.2 / 4 = 7 px of disparity: a quarter of a pixel is 3.6 %.
  EXPECT_LT(accuracy.median_error, 0.036);
}

TEST_F(DepthSweep, MovingAndTurningViewsSharpenIt) {
  const Scene scene;
  const std::vector<SE3> poses = {moved({-0.3, 0.02, 0.1}, {0, -0.06, 0.02}),
                                  moved({0.25, -0.1, -0.1}, {0.03, 0.05, 0})};
  const Accuracy accuracy = compare(scene, sweep(scene, poses, 1.0, serial_));
  EXPECT_GT(accuracy.share, 0.9);
  EXPECT_LT(accuracy.wrong, 0.01);
  EXPECT_LT(accuracy.median_error, 0.024);
}

TEST_F(DepthSweep, ExposureDoesNotMatter) {
  const Scene scene;
  const Accuracy accuracy = compare(scene, sweep(scene, {moved({-0.2, 0, 0})}, 0.6, serial_));
  EXPECT_GT(accuracy.share, 0.85);
  EXPECT_LT(accuracy.wrong, 0.02);
}

TEST_F(DepthSweep, KeepsNearAndFarApartAndForgetsWhatIsHidden) {
  const Scene scene{.with_screen = true, .wall_slope = 0};
  const SE3 right = moved({-0.2, 0, 0});
  const ImageF depth = sweep(scene, {right}, 1.0, serial_);
  EXPECT_LT(compare(scene, depth).wrong, 0.05);
  int hidden = 0, hidden_with_depth = 0, screen = 0, screen_found = 0;
  for (int y = 8; y < 112; ++y) {
    for (int x = 24; x < 136; ++x) {
      const Scene::Hit hit = scene.look(kCamera, kReference, x, y);
      const double seen_at = x - 0.2 * kCamera.fx / hit.depth;
      const bool is_hidden = !hit.screen && scene.look(kCamera, right, seen_at, y).screen;
      hidden += is_hidden;
      hidden_with_depth += is_hidden && depth(x, y) > 0 && std::abs(depth(x, y) - 4.0f) < 0.4f;
      screen += hit.screen;
      screen_found += hit.screen && std::abs(depth(x, y) - 2.0f) < 0.1f;
    }
  }
  ASSERT_GT(hidden, 200);
  EXPECT_LT(hidden_with_depth, hidden / 2) << "the wall behind the screen cannot be measured";
  EXPECT_GT(screen_found, 0.85 * screen);
}

TEST_F(DepthSweep, SaysNothingWithoutABaseline) {
  const Scene scene;
  const ImageF depth = sweep(scene, {moved(Vec3::Zero(), {0, 0.05, 0})}, 1.0, serial_);
  EXPECT_TRUE(std::ranges::all_of(depth.values(), [](float d) { return d == 0; }));
}

TEST_F(DepthSweep, SaysNothingOnAWhiteWall) {
  const ImageU8 white(kCamera.width, kCamera.height, 1, 200);
  const SweepView view{&white, kCamera, moved({-0.2, 0, 0})};
  const ImageF depth = sweep_depth({}, white, kCamera, {&view, 1}, kRange, serial_);
  EXPECT_LT(std::ranges::count_if(depth.values(), [](float d) { return d > 0; }), 200);
}

TEST_F(DepthSweep, IsTheSameAtAnyConcurrency) {
  const Scene scene{.with_screen = true};
  ThreadPool pool(3);
  const std::vector<SE3> poses = {moved({-0.2, 0, 0}), moved({0.1, 0.1, 0})};
  EXPECT_EQ(sweep(scene, poses, 1.0, serial_), sweep(scene, poses, 1.0, pool));
}

}  // namespace
}  // namespace photoslam
