// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/doubled_gaussians.h"

#include <gtest/gtest.h>

#include <cmath>

#include "math/se3.h"

namespace photoslam {
namespace {

constexpr double kSpacing = 0.1;

/// A wall of discs, seen twice: the frames of both keyframes differ, the wall is the same.
class DoubledWall : public ::testing::Test {
 protected:
  DoubledWall() {
    for (int i = 0; i < 2; ++i) model.add_anchor();
    add(0, 0.0f, 0.5f);
    add(1, 0.0f, 2.0f);
  }

  void add(int anchor, float red, float opacity_logit) {
    std::vector<splatting::Gaussian> discs;
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 10; ++x) {
        splatting::Gaussian g;
        const Vec3 mean = after[static_cast<size_t>(anchor)] * Vec3(kSpacing * x, kSpacing * y, 3);
        for (int i = 0; i < 3; ++i) {
          g.mean[i] = static_cast<float>(mean[i]);
          g.log_scale[i] = static_cast<float>(std::log(i == 2 ? 0.01 : 0.5 * kSpacing));
        }
        g.opacity_logit = opacity_logit;
        g.sh[0][0] = red;
        discs.push_back(g);
      }
    }
    model.add(anchor, discs);
  }
  size_t merge(const DoublingOptions& options = {}) {
    const std::vector<int> seams{0, 1};
    return merge_doubled(options, before, after, seams, model);
  }

  splatting::GaussianModel model;
  std::vector<Sim3> after{Sim3{}, Sim3(1, so3_exp(Vec3(0, 0.3, 0)), Vec3(-1, 0, 0.5))};
  std::vector<Sim3> before{Sim3{}, Sim3(1, so3_exp(Vec3(0, 0.3, 0)), Vec3(-1, 0.4, 0.5))};  // 0.4 m of drift
};

TEST_F(DoubledWall, BecomesOne) {
  EXPECT_EQ(merge(), 100u);
  EXPECT_EQ(model.size(0), 100u);
  EXPECT_EQ(model.size(1), 0u);
  model.for_each([&](size_t i) { EXPECT_EQ(model.get(i).opacity_logit, 2.0f) << "the more opaque one's"; });
  EXPECT_EQ(merge(), 0u);
}

TEST_F(DoubledWall, StaysWithoutACorrection) {
  before = after;
  EXPECT_EQ(merge(), 0u);
  EXPECT_EQ(model.size(), 200u);
}

TEST_F(DoubledWall, KeepsWhatLooksDifferent) {
  add(1, 1.5f, 2.0f);  // red discs in the same places
  EXPECT_EQ(merge(), 100u);
  EXPECT_EQ(model.size(1), 100u);
}

TEST_F(DoubledWall, KeepsWhatLiesElsewhere) {
  for (Sim3* anchor : {&after[1], &before[1]}) anchor->translation.z() += 2 * kSpacing;  // a layer in front
  EXPECT_EQ(merge(), 0u);
}

TEST_F(DoubledWall, OnlyAtSeams) {
  const std::vector<int> seams{1};
  EXPECT_EQ(merge_doubled({}, before, after, seams, model), 0u);
}

}  // namespace
}  // namespace photoslam
