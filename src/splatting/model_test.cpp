// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/check.h"
#include "base/random.h"

namespace photoslam::splatting {
namespace {

Gaussian numbered(int i) {
  Gaussian g;
  g.mean[0] = static_cast<float>(i);
  g.sh[15][2] = static_cast<float>(-i);
  return g;
}

/// 300 gaussians over 3 anchors, interleaved; gaussian i has mean.x = i and tag i.
GaussianModel make_model() {
  GaussianModel model;
  for (int a = 0; a < 3; ++a) model.add_anchor();
  for (int i = 0; i < 300; ++i) {
    const Gaussian g = numbered(i);
    model.add(i % 3, {&g, 1}, static_cast<uint32_t>(i));
  }
  return model;
}

TEST(GaussianModel, KeepsBlocksOfOneAnchor) {
  const GaussianModel model = make_model();
  EXPECT_EQ(model.size(), 300u);
  EXPECT_EQ(model.num_blocks(), 6u);
  for (int a = 0; a < 3; ++a) EXPECT_EQ(model.size(a), 100u);
  size_t visited = 0;
  model.for_each([&](size_t index) {
    EXPECT_TRUE(model.contains(index));
    EXPECT_EQ(model.anchor(index), static_cast<int>(model.tag(index) % 3));
    EXPECT_EQ(model.get(index).mean[0], static_cast<float>(model.tag(index)));
    ++visited;
  });
  EXPECT_EQ(visited, 300u);
  EXPECT_FALSE(model.contains(model.index_end()));
}

TEST(GaussianModel, RemovalKeepsOrderAndState) {
  GaussianModel model = make_model();
  model.for_each([&](size_t index) {
    Block& block = model.block(index / kBlockSize);
    block.first_moments[5][index % kBlockSize] = block.parameters[0][index % kBlockSize];
    block.weight[index % kBlockSize] = 2 * block.parameters[0][index % kBlockSize];
  });
  const size_t removed = model.remove_if([&](size_t index) { return model.tag(index) % 5 != 1; });
  EXPECT_EQ(removed, 240u);
  EXPECT_EQ(model.size(), 60u);
  EXPECT_EQ(model.num_blocks(), 3u);
  int last_anchor = -1;
  uint32_t last_tag = 0;
  model.for_each([&](size_t index) {
    const uint32_t tag = model.tag(index);
    EXPECT_EQ(tag % 5, 1u);
    EXPECT_EQ(model.get(index).sh[15][2], -static_cast<float>(tag));
    EXPECT_EQ(model.block(index / kBlockSize).first_moments[5][index % kBlockSize], static_cast<float>(tag));
    EXPECT_EQ(model.statistics(index).weight, 2 * static_cast<float>(tag));
    EXPECT_TRUE(model.anchor(index) != last_anchor || tag > last_tag);
    last_anchor = model.anchor(index);
    last_tag = tag;
  });
  // Lanes left free are clean, and get used again.
  const Gaussian g = numbered(1000);
  const size_t index = model.add(0, {&g, 1}).front();
  EXPECT_EQ(model.num_blocks(), 3u);
  EXPECT_EQ(model.statistics(index).weight, 0);
  EXPECT_EQ(model.block(index / kBlockSize).first_moments[5][index % kBlockSize], 0);
}

TEST(GaussianModel, RemovingAllLeavesAnEmptyModel) {
  GaussianModel model = make_model();
  EXPECT_EQ(model.remove(std::vector<uint8_t>(model.index_end(), 1)), 300u);
  EXPECT_TRUE(model.empty());
  EXPECT_EQ(model.num_blocks(), 0u);
  EXPECT_EQ(model.num_anchors(), 3);
  EXPECT_THROW(model.remove(std::vector<uint8_t>(5)), CheckError);
}

TEST(GaussianModel, BoundsHoldEveryGaussian) {
  Random random(3);
  GaussianModel model;
  model.add_anchor();
  std::vector<Gaussian> gaussians(500);
  for (Gaussian& g : gaussians) {
    for (float& m : g.mean) m = static_cast<float>(random.normal());
    for (float& s : g.log_scale) s = static_cast<float>(random.uniform(-6, -2));
  }
  model.add(0, gaussians);
  const auto total_radius = [&] {
    float sum = 0;
    for (size_t b = 0; b < model.num_blocks(); ++b) {
      const Block& block = model.block(b);
      sum += block.radius;
      for (int lane = 0; lane < block.count; ++lane) {
        double d2 = 0;
        for (int i = 0; i < 3; ++i) d2 += std::pow(block.parameters[i][lane] - block.center[i], 2);
        EXPECT_LE(std::sqrt(d2), block.radius * 1.00001);
        for (int i = 0; i < 3; ++i)
          EXPECT_LE(std::exp(block.parameters[row::kLogScale + i][lane]), block.max_scale * 1.00001f);
      }
    }
    return sum;
  };
  const float before = total_radius();
  model.sort_spatially();
  EXPECT_LT(total_radius(), 0.7f * before);
  std::set<float> want, got;
  for (const Gaussian& g : gaussians) want.insert(g.mean[0]);
  model.for_each([&](size_t index) { got.insert(model.get(index).mean[0]); });
  EXPECT_EQ(got, want);
}

TEST(GaussianModel, AppendedModelFollowsOnTheAnchors) {
  GaussianModel model = make_model();
  model.append(make_model());
  EXPECT_EQ(model.num_anchors(), 6);
  EXPECT_EQ(model.size(), 600u);
  std::set<std::pair<int, uint32_t>> found;  // anchor, tag
  model.for_each([&](size_t i) {
    EXPECT_EQ(model.get(i).mean[0], static_cast<float>(model.tag(i)));
    found.emplace(model.anchor(i), model.tag(i));
  });
  for (int i = 0; i < 300; ++i) {
    EXPECT_TRUE(found.contains({i % 3, static_cast<uint32_t>(i)}));
    EXPECT_TRUE(found.contains({3 + i % 3, static_cast<uint32_t>(i)}));
  }
}

TEST(GaussianModel, RescalingAnAnchorScalesMeansAndDeviations) {
  GaussianModel model = make_model();
  model.rescale_anchor(1, 2);
  model.for_each([&](size_t index) {
    const float factor = model.anchor(index) == 1 ? 2.0f : 1.0f;
    EXPECT_EQ(model.get(index).mean[0], factor * static_cast<float>(model.tag(index)));
    EXPECT_NEAR(std::exp(model.get(index).log_scale[2]), factor, 1e-6);
  });
}

}  // namespace
}  // namespace photoslam::splatting
