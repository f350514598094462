// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/html/trajectory_plot.h"

#include <gmock/gmock.h>

#include <regex>

namespace photoslam::html {
namespace {

using testing::HasSubstr;

/// An L in a tilted plane: 4 m along one direction, 2 m along another at a right angle.
Trajectory tilted_corner() {
  const Vec3 along = Vec3(1, 2, 2) / 3, across = Vec3(2, 1, -2) / 3;
  Trajectory trajectory;
  for (int i = 0; i <= 40; ++i) trajectory.push_back({i * 1'000'000, SE3(Quat::Identity(), 0.1 * i * along)});
  for (int i = 1; i <= 20; ++i) {
    trajectory.push_back({(40 + i) * 1'000'000, SE3(Quat::Identity(), 4 * along + 0.1 * i * across)});
  }
  return trajectory;
}

/// Corners of the path with the given class.
std::vector<Vec2> path_points(const std::string& svg, const std::string& css_class) {
  std::smatch match;
  EXPECT_TRUE(std::regex_search(svg, match, std::regex("curve " + css_class + "\" d=\"([^\"]*)\"")));
  const std::string path = match[1];
  const std::regex point("[ML]([-0-9.]+) ([-0-9.]+)");
  std::vector<Vec2> points;
  for (std::sregex_iterator it(path.begin(), path.end(), point), end; it != end; ++it) {
    points.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
  }
  return points;
}

TEST(TrajectoryPlot, ShowsTrueShapeFromAbove) {
  const std::string svg = draw_trajectories(tilted_corner(), {});
  const std::vector<Vec2> points = path_points(svg, "estimate");
  ASSERT_EQ(points.size(), 61u);
  const Vec2 first = points[40] - points[0], second = points[60] - points[40];
  EXPECT_NEAR(first.norm() / second.norm(), 2, 0.01);
  EXPECT_NEAR(first.normalized().dot(second.normalized()), 0, 0.01);
  EXPECT_THAT(svg, HasSubstr("1 m</text>"));
}

TEST(TrajectoryPlot, BothTrajectoriesShareOneFrame) {
  const Trajectory truth = tilted_corner();
  Trajectory estimate(truth.begin(), truth.begin() + 30);
  const std::string svg = draw_trajectories(estimate, truth);
  const std::vector<Vec2> green = path_points(svg, "truth"), red = path_points(svg, "estimate");
  ASSERT_EQ(green.size(), 61u);
  ASSERT_EQ(red.size(), 30u);
  for (size_t i = 0; i < red.size(); ++i) EXPECT_LT((red[i] - green[i]).norm(), 1e-9);
}

TEST(TrajectoryPlot, StandsStillWithoutDividingByZero) {
  const Trajectory still(5, StampedPose{});
  const std::string svg = draw_trajectories(still, still);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_EQ(draw_trajectories({}, {}), "");
}

}  // namespace
}  // namespace photoslam::html
