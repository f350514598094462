// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/densification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace photoslam {
namespace {

using splatting::Gaussian;
using splatting::kBlockSize;

Gaussian gaussian(float scale, float opacity_logit = 2) {
  Gaussian g;
  for (float& s : g.log_scale) s = std::log(scale);
  g.opacity_logit = opacity_logit;
  return g;
}

class DensificationTest : public ::testing::Test {
 protected:
  size_t add(const Gaussian& g, float mean_gradient, float max_weight = 0.5f) {
    const size_t index = model.add(0, std::span(&g, 1)).front();
    splatting::Block& block = model.block(index / kBlockSize);
    block.visible[index % kBlockSize] = 10;
    block.gradient[index % kBlockSize] = 10 * mean_gradient;
    block.max_weight[index % kBlockSize] = max_weight;
    return index;
  }
  DensificationTest() { model.add_anchor(); }

  DensificationOptions options;
  Random random{1};
  splatting::GaussianModel model;
};

TEST_F(DensificationTest, SmallOnesAreClonedLargeOnesSplitCalmOnesLeftAlone) {
  const auto high = static_cast<float>(2 * options.gradient_threshold);
  const auto low = static_cast<float>(0.5 * options.gradient_threshold);
  const auto small = static_cast<float>(0.5 * options.split_size), large = static_cast<float>(4 * options.split_size);
  add(gaussian(small), high);
  add(gaussian(large), high);
  add(gaussian(small), low);
  add(gaussian(large), low);
  const DensificationCounts counts = densify(options, 1.0, random, model);
  EXPECT_EQ(counts.cloned, 1u);
  EXPECT_EQ(counts.split, 1u);
  EXPECT_EQ(counts.pruned, 0u);
  EXPECT_EQ(model.size(), 6u);
  int halves = 0;
  model.for_each([&](size_t i) {
    if (std::abs(std::exp(model.get(i).log_scale[0]) - large / 1.6f) < 1e-6f) ++halves;
    EXPECT_EQ(model.statistics(i).visible, 0) << "statistics start anew";
  });
  EXPECT_EQ(halves, 2);
}

TEST_F(DensificationTest, TheBudgetHolds) {
  options.max_gaussians = 12;
  for (int i = 0; i < 10; ++i) add(gaussian(0.001f), 1);
  densify(options, 1.0, random, model);
  EXPECT_EQ(model.size(), 12u);
  model.for_each([&](size_t i) {
    model.block(i / kBlockSize).visible[i % kBlockSize] = 1;
    model.block(i / kBlockSize).gradient[i % kBlockSize] = 1;
  });
  densify(options, 1.0, random, model);
  EXPECT_EQ(model.size(), 12u);
}

TEST_F(DensificationTest, GaussiansThatNeverMatterAreRemoved) {
  add(gaussian(0.01f), 0, static_cast<float>(0.5 * options.min_weight));
  add(gaussian(0.01f), 0);
  EXPECT_EQ(densify(options, 1.0, random, model).pruned, 1u);
  EXPECT_EQ(model.size(), 1u);
}

TEST_F(DensificationTest, PruningTheIdleLooksAtOnePeriodAfterTheOther) {
  add(gaussian(0.01f), 0, static_cast<float>(0.5 * options.min_weight));
  add(gaussian(0.01f), 0);
  EXPECT_EQ(prune_idle(options, model), 1u);
  EXPECT_EQ(prune_idle(options, model), 0u) << "nobody has looked since";
  EXPECT_EQ(model.size(), 1u);
}

TEST_F(DensificationTest, PruningRemovesTransparentHugeAndBrokenOnes) {
  Gaussian broken = gaussian(0.01f);
  broken.mean[1] = std::numeric_limits<float>::quiet_NaN();
  add(gaussian(0.01f), 0);
  add(gaussian(0.01f, -8), 0);
  add(gaussian(static_cast<float>(2 * options.max_scale)), 0);
  add(broken, 0);
  EXPECT_EQ(prune(options, 1.0, model), 3u);
  EXPECT_EQ(model.size(), 1u);
}

TEST_F(DensificationTest, WhatWeighsLeastMakesRoom) {
  options.max_gaussians = 6;
  for (const float weight : {5.0f, 1.0f, 4.0f, 2.0f, 3.0f}) {
    const size_t index = add(gaussian(weight), 0);
    model.block(index / kBlockSize).weight[index % kBlockSize] = 10 * weight;
  }
  add(gaussian(0.1f), 0);
  model.block(0).visible[5] = 2;  // born a moment ago: too early to judge
  EXPECT_EQ(make_room(options, 0, model), 0u);
  EXPECT_EQ(make_room(options, 2, model), 2u);
  std::vector<float> left;
  model.for_each([&](size_t i) { left.push_back(std::round(10 * std::exp(model.get(i).log_scale[0])) / 10); });
  EXPECT_EQ(left, (std::vector{5.0f, 4.0f, 3.0f, 0.1f}));
  EXPECT_EQ(make_room(options, 100, model), 3u) << "no more than can be judged";
}

TEST_F(DensificationTest, WhatIsLeastPresentGoesBeyondTheBudget) {
  const auto at = [](float distance, float scale, float opacity_logit) {
    Gaussian g = gaussian(scale, opacity_logit);
    g.mean[2] = distance;
    return g;
  };
  Gaussian broken = at(1, 0.01f, 2);
  broken.log_scale[1] = std::numeric_limits<float>::quiet_NaN();
  Gaussian flat = at(1, 0.04f, 2);  // a disc is as large as a ball
  flat.log_scale[0] = -20;
  add(at(1, 0.02f, 2), 0);   // 0: 4 units of 1e-4
  add(broken, 0);            // 1
  add(at(4, 0.04f, 2), 0);   // 2: 1 unit
  add(flat, 0);              // 3: 16 units
  add(at(1, 0.02f, -8), 0);  // 4: next to nothing
  add(at(10, 0.30f, 2), 0);  // 5: 9 units
  for (size_t i = 0; i < 6; ++i) model.set_tag(i, static_cast<uint32_t>(i));
  options.max_gaussians = 6;
  EXPECT_EQ(keep_budget(options, model), 0u);
  const auto left = [&](int budget) {
    options.max_gaussians = budget;
    keep_budget(options, model);
    std::vector<uint32_t> tags;
    model.for_each([&](size_t i) { tags.push_back(model.tag(i)); });
    return tags;
  };
  EXPECT_EQ(left(5), (std::vector<uint32_t>{0, 2, 3, 4, 5}));
  EXPECT_EQ(left(4), (std::vector<uint32_t>{0, 2, 3, 5}));
  EXPECT_EQ(left(3), (std::vector<uint32_t>{0, 3, 5}));
  EXPECT_EQ(left(1), (std::vector<uint32_t>{3}));
}

}  // namespace
}  // namespace photoslam
