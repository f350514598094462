// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/handover.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "map/map_spacing.h"
#include "photorealistic_mapping/view_geometry.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera = {160, 120, 140, 140, 79.5, 59.5};

/// A wall of opaque discs 3 m before an old keyframe, and one 4 m away that it hides; a new keyframe has drifted.
class Handover : public ::testing::Test {
 protected:
  Handover() {
    for (int i = 0; i < 2; ++i) model.add_anchor();
    for (const double depth : {3.0, 4.0}) {
      std::vector<splatting::Gaussian> discs;
      for (double y = -2; y <= 2; y += 0.1) {
        for (double x = -2; x <= 2; x += 0.1) {
          splatting::Gaussian g;
          const Vec3 mean(x, y, depth);
          for (int i = 0; i < 3; ++i) {
            g.mean[i] = static_cast<float>(mean[i]);
            g.log_scale[i] = static_cast<float>(std::log(i == 2 ? 0.005 : 0.1));
          }
          g.rotation[0] = 1;
          g.opacity_logit = 4;
          discs.push_back(g);
        }
      }
      model.add(0, discs, depth < 3.5 ? kFront : kHidden);
    }
  }

  std::vector<splatting::Pose> poses(size_t camera, const std::vector<Sim3>& anchors) const {
    std::vector<SE3> anchors_from_world;
    for (const Sim3& anchor : anchors) anchors_from_world.push_back(anchor.rigid());
    std::vector<splatting::Pose> result;
    camera_from_anchors(anchors_from_world[camera], anchors_from_world, result);
    return result;
  }
  splatting::RenderResult render(const std::vector<splatting::Pose>& camera_from_anchor) {
    SerialExecutor executor;
    splatting::RenderResult result;
    splatting::Renderer().render(model, {to_splatting(kCamera), camera_from_anchor}, {}, executor, result);
    return result;
  }
  LastViewers shown_by_both() {
    LastViewers viewers(model);
    for (int keyframe : {0, 1}) {
      const auto camera_from_anchor = poses(static_cast<size_t>(keyframe), before);
      viewers.show(keyframe, kCamera, camera_from_anchor, render(camera_from_anchor));
    }
    return viewers;
  }

  static constexpr uint32_t kFront = 1, kHidden = 2;
  splatting::GaussianModel model;
  std::vector<Sim3> before{Sim3{}, Sim3(1, so3_exp(Vec3(0, 0.1, 0)), Vec3(0.2, 0, 0))};
  std::vector<Sim3> after{Sim3{}, Sim3(1, so3_exp(Vec3(0, 0.1, 0)), Vec3(0.6, 0, 0))};
};

TEST_F(Handover, WhatAKeyframeShowedLastStaysInItsPicture) {
  const std::vector<float> was = render(poses(1, before)).depth;
  const size_t handed = hand_over(2.0, kCamera, before, after, shown_by_both(), model);
  EXPECT_GT(handed, 500u);
  EXPECT_EQ(model.size(1), handed);
  const std::vector<float> is = render(poses(1, after)).depth;
  double largest = 0;
  for (int y = 20; y < 100; ++y) {
    for (int x = 40; x < 120; ++x) {
      const auto at = static_cast<size_t>(y * kCamera.width + x);
      largest = std::max(largest, static_cast<double>(std::abs(is[at] - was[at])));
    }
  }
  EXPECT_LT(largest, 0.02);
}

TEST_F(Handover, WhatIsHiddenOrOutOfSightStaysWhereItIs) {
  hand_over(2.0, kCamera, before, after, shown_by_both(), model);
  model.for_each([&](size_t i) {
    if (model.anchor(i) == 1) {
      EXPECT_EQ(model.tag(i), kFront);
    }
  });
}

TEST_F(Handover, WhatLiesInAnotherMapIsNotShown) {
  model = {};
  model.add_anchor();
  splatting::Gaussian far;
  far.mean[2] = static_cast<float>(kMapSpacing);
  for (float& log_scale : far.log_scale) log_scale = static_cast<float>(std::log(0.5 * kMapSpacing));
  far.rotation[0] = 1;
  far.opacity_logit = 4;
  model.add(0, {&far, 1});
  const auto camera_from_anchor = poses(0, {Sim3{}});
  const auto picture = render(camera_from_anchor);
  EXPECT_GT(*std::ranges::max_element(picture.alpha), 0.9f) << "nothing else is there to hide it";
  LastViewers viewers(model);
  viewers.show(0, kCamera, camera_from_anchor, picture);
  EXPECT_EQ(viewers[0], LastViewers::kNobody);
}

TEST_F(Handover, NothingChangesHandsWithoutACorrection) {
  EXPECT_EQ(hand_over(2.0, kCamera, before, before, shown_by_both(), model), 0u);
  EXPECT_EQ(model.size(1), 0u);
}

TEST_F(Handover, ScalesChangeThePlaceButNotTheLook) {
  // The new keyframe has grown by a half since birth; the correction moves it and lets it grow further.
  before[1] = Sim3(1 / 1.5, before[1].rotation, before[1].translation / 1.5);
  after[1] = Sim3(1 / 1.8, before[1].rotation, before[1].translation + Vec3(0.3, 0, 0));
  const std::vector<float> was = render(poses(1, before)).depth;
  ASSERT_GT(hand_over(2.0, kCamera, before, after, shown_by_both(), model), 500u);
  const std::vector<float> is = render(poses(1, before)).depth;
  for (size_t i = 0; i < was.size(); ++i) ASSERT_NEAR(is[i], was[i], 5e-3) << i;  // means are fp32, and order ties
}

TEST_F(Handover, AdoptedGaussiansStayInTheWorld) {
  const size_t all = model.size();
  const std::vector<float> was = render(poses(0, before)).depth;
  const SE3 to_from_from = before[1].rigid() * before[0].rigid().inverse();
  EXPECT_EQ(adopt(std::vector{Adoption{0, 1, to_from_from}}, model), all);
  EXPECT_EQ(model.size(0), 0u);
  EXPECT_EQ(model.size(1), all);
  const std::vector<float> is = render(poses(0, before)).depth;
  ASSERT_EQ(is.size(), was.size());
  // Rounding may carry a splat across the cut-off at alpha = 1/255, no farther away than 4 m.
  for (size_t i = 0; i < is.size(); ++i) ASSERT_NEAR(is[i], was[i], 4.1 / 255) << i;
}

}  // namespace
}  // namespace photoslam
