// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/view_redundancy.h"

#include <gtest/gtest.h>

#include <vector>

namespace photoslam {
namespace {

SE3 looking(double x, double yaw) {
  const Quat rotation(Eigen::AngleAxisd(yaw, Vec3::UnitY()));
  return {rotation, rotation * Vec3(-x, 0, 0)};
}

TEST(ViewRedundancy, TheOlderOfTheNearestTwoGoes) {
  EXPECT_EQ(most_redundant_view(std::vector{looking(0, 0), looking(1, 0), looking(3, 0), looking(3.2, 0)}, 2.0), 2u);
}

TEST(ViewRedundancy, DirectionCountsBesidePlace) {
  // At one place but a quarter turn apart; the others are half a scene depth apart and look the same way.
  EXPECT_EQ(most_redundant_view(std::vector{looking(0, 0), looking(0, 1.57), looking(5, 0), looking(6, 0)}, 2.0), 2u);
}

TEST(ViewRedundancy, ThinsOutEvenly) {
  std::vector<SE3> views;
  for (int lap = 0; lap < 3; ++lap) {
    for (int i = 0; i < 16; ++i) views.push_back(looking(i + 0.01 * lap, 0));
  }
  while (views.size() > 16) {
    views.erase(views.begin() + static_cast<std::ptrdiff_t>(most_redundant_view(views, 1.0)));
  }
  for (size_t i = 0; i < views.size(); ++i) {
    EXPECT_NEAR(-views[i].translation.x(), static_cast<double>(i) + 0.02, 1e-9) << "the latest view of each place";
  }
}

}  // namespace
}  // namespace photoslam
