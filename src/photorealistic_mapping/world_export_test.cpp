// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/world_export.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/executor.h"
#include "base/random.h"
#include "photorealistic_mapping/view_geometry.h"
#include "splatting/formulas.h"
#include "splatting/renderer.h"

namespace photoslam {
namespace {

using splatting::Gaussian;

SE3 random_pose(Random& random) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = random.uniform(-2, 2);
  return SE3::exp(twist);
}

/// A cloud in front of a camera at the origin of its anchor.
std::vector<Gaussian> random_cloud(Random& random, int count) {
  std::vector<Gaussian> cloud(static_cast<size_t>(count));
  for (Gaussian& g : cloud) {
    g.mean[0] = static_cast<float>(random.uniform(-1, 1));
    g.mean[1] = static_cast<float>(random.uniform(-1, 1));
    g.mean[2] = static_cast<float>(random.uniform(2, 4));
    for (float& q : g.rotation) q = static_cast<float>(random.normal());
    for (float& s : g.log_scale) s = static_cast<float>(std::log(random.uniform(0.02, 0.15)));
    g.opacity_logit = static_cast<float>(random.uniform(-2, 2));
    for (auto& coefficient : g.sh) {
      for (float& c : coefficient) c = static_cast<float>(0.2 * random.normal());
    }
  }
  return cloud;
}

TEST(ShRotation, TheColourTravelsWithTheDirection) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Mat3 rotation = random_pose(random).matrix3();
    float before[16][3], after[16][3];
    for (auto& coefficient : before) {
      for (float& c : coefficient) c = static_cast<float>(random.normal());
    }
    std::copy(&before[0][0], &before[0][0] + 48, &after[0][0]);
    ShRotation(rotation).apply(after);
    const Vec3 direction = Vec3(random.normal(), random.normal(), random.normal()).normalized();
    const Vec3 turned = rotation * direction;
    double basis_before[16], basis_after[16];
    splatting::scalar::sh_basis(3, direction.data(), basis_before);
    splatting::scalar::sh_basis(3, turned.data(), basis_after);
    for (int c = 0; c < 3; ++c) {
      double a = 0, b = 0;
      for (int k = 0; k < 16; ++k) {
        a += basis_before[k] * static_cast<double>(before[k][c]);
        b += basis_after[k] * static_cast<double>(after[k][c]);
      }
      EXPECT_NEAR(a, b, 1e-5);
    }
  }
}

class WorldExportTest : public ::testing::Test {
 protected:
  splatting::RenderResult render(const splatting::GaussianModel& model, const std::vector<SE3>& anchors_from_world,
                                 const SE3& camera_from_world) {
    std::vector<splatting::Pose> poses;
    camera_from_anchors(camera_from_world, anchors_from_world, poses);
    splatting::Renderer renderer;
    splatting::RenderResult result;
    renderer.render(model, {to_splatting({80, 60, 70, 70, 41, 28}), poses}, {}, serial, result);
    return result;
  }
  static float largest_difference(const splatting::RenderResult& a, const splatting::RenderResult& b) {
    float largest = 0;
    for (size_t i = 0; i < a.rgb.size(); ++i) largest = std::max(largest, std::abs(a.rgb[i] - b.rgb[i]));
    return largest;
  }
  SerialExecutor serial;
  Random random{2};
};

TEST_F(WorldExportTest, TheExportedMapLooksTheSame) {
  splatting::GaussianModel model;
  std::vector<SE3> anchors;
  for (int a = 0; a < 3; ++a) {
    anchors.push_back(SE3::exp(0.05 * random_pose(random).log()));
    model.add(model.add_anchor(), random_cloud(random, 100));
  }
  const auto anchored = render(model, anchors, SE3{});
  const auto exported = render(from_world(to_world(model, anchors)), {SE3{}}, SE3{});
  EXPECT_GT(*std::ranges::max_element(anchored.alpha), 0.5f) << "an empty picture proves nothing";
  EXPECT_LT(largest_difference(anchored, exported), 1e-4f);
}

TEST_F(WorldExportTest, MovingMapAndCamerasTogetherChangesNothing) {
  splatting::GaussianModel model;
  std::vector<SE3> anchors, moved;
  const SE3 old_from_new = random_pose(random);
  for (int a = 0; a < 3; ++a) {
    anchors.push_back(SE3::exp(0.05 * random_pose(random).log()));
    moved.push_back(anchors.back() * old_from_new);
    model.add(model.add_anchor(), random_cloud(random, 100));
  }
  EXPECT_LT(largest_difference(render(model, anchors, SE3{}), render(model, moved, old_from_new)), 1e-4f);
  const auto in_old = render(from_world(to_world(model, anchors)), {SE3{}}, SE3{});
  const auto in_new = render(from_world(to_world(model, moved)), {SE3{}}, old_from_new);
  EXPECT_LT(largest_difference(in_old, in_new), 1e-4f) << "also once exported";
}

TEST_F(WorldExportTest, AnchorsOfAnotherWorldAreLeftOut) {
  splatting::GaussianModel model, of_one;
  const std::vector<SE3> anchors = {random_pose(random), random_pose(random), random_pose(random)};
  for (int a = 0; a < 3; ++a) {
    const auto cloud = random_cloud(random, 70 + a);  // more than a block holds
    model.add(model.add_anchor(), cloud);
    if (a == 1) of_one.add(of_one.add_anchor(), cloud);
  }
  const std::vector<uint8_t> chosen = {0, 1, 0};
  const GaussianTable part = to_world(model, anchors, chosen),
                      alone = to_world(of_one, std::span(anchors).subspan(1, 1));
  ASSERT_EQ(part.size(), 71u);
  for (size_t i = 0; i < part.size(); ++i) {
    EXPECT_TRUE(std::ranges::equal(part.row(i), alone.row(i))) << i;
  }
  EXPECT_EQ(to_world(model, anchors, std::vector<uint8_t>{1, 1, 1}).size(), model.size());
}

TEST_F(WorldExportTest, CoefficientsBeyondTheDegreeInUseAreZero) {
  splatting::GaussianModel model;
  model.set_sh_degree(1);
  model.add(model.add_anchor(), random_cloud(random, 5));
  const GaussianTable table = to_world(model, std::vector<SE3>{random_pose(random)});
  for (size_t i = 0; i < table.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NE(table.row(i)[GaussianTable::kShRest + 15 * c], 0.0f);
      for (size_t k = 3; k < 15; ++k) EXPECT_EQ(table.row(i)[GaussianTable::kShRest + 15 * c + k], 0.0f);
    }
  }
}

}  // namespace
}  // namespace photoslam
