// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/density.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace photoslam::splatting {
namespace {

TEST(Density, HalvesAreDrawnFromTheirParent) {
  Gaussian parent;
  const double sigma[3] = {0.2, 0.05, 0.01};
  for (int i = 0; i < 3; ++i) {
    parent.mean[i] = static_cast<float>(1 + i);
    parent.log_scale[i] = static_cast<float>(std::log(sigma[i]));
  }
  parent.rotation[0] = parent.rotation[3] = 2;  // a quarter turn about z, of any norm
  GaussianModel model;
  model.add_anchor();
  constexpr size_t kParents = 5000;
  model.add(0, std::vector<Gaussian>(kParents, parent));
  std::vector<Fate> fates(model.index_end(), Fate::stays);
  model.for_each([&](size_t i) { fates[i] = Fate::splits; });
  Random random(3);
  std::vector<double> normals(6 * kParents);
  for (double& n : normals) n = random.normal();
  model.breed(fates, normals);

  ASSERT_EQ(model.size(), 2 * kParents);
  double sum[3] = {}, squares[3] = {}, xy = 0;
  model.for_each([&](size_t i) {
    const Gaussian g = model.get(i);
    double d[3];
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(std::exp(static_cast<double>(g.log_scale[k])), sigma[k] / 1.6, 1e-6);
      d[k] = static_cast<double>(g.mean[k]) - (1 + k);
      sum[k] += d[k];
      squares[k] += d[k] * d[k];
    }
    xy += d[0] * d[1];
  });
  const double turned[3] = {sigma[1], sigma[0], sigma[2]}, n = 2 * kParents;
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(sum[k] / n, 0, 4 * turned[k] / std::sqrt(n)) << k;
    EXPECT_NEAR(std::sqrt(squares[k] / n), turned[k], 4 * turned[k] / std::sqrt(2 * n)) << k;
  }
  EXPECT_NEAR(xy / n, 0, 4 * turned[0] * turned[1] / std::sqrt(n));
}

TEST(Density, ChildrenStayWithTheAnchorOfTheirParentInOrder) {
  GaussianModel model;
  for (int anchor = 0; anchor < 2; ++anchor) {
    model.add_anchor();
    for (int i = 0; i < 3; ++i) {
      Gaussian g;
      g.sh[0][0] = static_cast<float>(10 * anchor + i);
      model.add(anchor, {&g, 1}, static_cast<uint32_t>(70 + 10 * anchor + i));
    }
  }
  std::vector<Fate> fates(model.index_end(), Fate::stays);
  fates[0] = Fate::clones;
  fates[1] = Fate::splits;
  fates[kBlockSize] = Fate::goes;
  fates[kBlockSize + 2] = Fate::clones;
  model.breed(fates, std::vector<double>(6));
  std::vector<float> colors;
  std::vector<uint32_t> tags;
  model.for_each([&](size_t i) {
    colors.push_back(model.get(i).sh[0][0]);
    tags.push_back(model.tag(i));
  });
  EXPECT_EQ(colors, (std::vector<float>{0, 2, 0, 1, 1, 11, 12, 12}));
  EXPECT_EQ(tags, (std::vector<uint32_t>{70, 72, 70, 71, 71, 81, 82, 82}));
  EXPECT_EQ(model.size(0), 5u);
}

}  // namespace
}  // namespace photoslam::splatting
