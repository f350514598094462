// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/similarity_ransac.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace photoslam {
namespace {

constexpr PinholeCamera kCamera{640, 480, 525, 525, 319.5, 239.5};
const Sim3 kScaled{1.3, so3_exp(Vec3(0.05, -0.2, 0.1)), Vec3(0.3, -0.1, 0.2)};
const Sim3 kRigid{1.0, kScaled.rotation, kScaled.translation};

/// Points before both cameras, seen with noise [px] and known to a relative depth error; some are paired wrongly.
std::vector<PointMatch> make_matches(const Sim3& b_from_a, int count, double noise, double depth_error,
                                     double wrong_share, uint64_t seed) {
  Random random(seed);
  std::vector<PointMatch> matches;
  while (static_cast<int>(matches.size()) < count) {
    PointMatch m;
    m.point_in_a = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1.5, 4)};
    m.point_in_b = b_from_a * m.point_in_a;
    const auto see = [&](Vec3& x, Vec2& pixel) {
      pixel = kCamera.project(x) + noise * Vec2(random.normal(), random.normal());
      x = kCamera.unproject(pixel, x.z() * (1 + depth_error * random.normal()));
    };
    see(m.point_in_a, m.pixel_in_a);
    see(m.point_in_b, m.pixel_in_b);
    matches.push_back(m);
  }
  const auto wrong = static_cast<size_t>(wrong_share * count);
  for (size_t i = 0; i + 1 < wrong; i += 2) {
    std::swap(matches[i].point_in_b, matches[i + 1].point_in_b);
    std::swap(matches[i].pixel_in_b, matches[i + 1].pixel_in_b);
  }
  return matches;
}

TEST(SimilarityRansac, RecoversTheExactTransformAmongOutliers) {
  for (const bool with_scale : {true, false}) {
    const Sim3& truth = with_scale ? kScaled : kRigid;
    const auto matches = make_matches(truth, 100, 0, 0, 0.5, 1);
    const auto result = estimate_similarity_ransac({}, kCamera, with_scale, matches);
    ASSERT_TRUE(result.success);
    EXPECT_GE(result.num_inliers, 50);
    EXPECT_LT((result.b_from_a * truth.inverse()).log().norm(), 1e-9);
    EXPECT_TRUE(with_scale || result.b_from_a.scale == 1.0);
  }
}

TEST(SimilarityRansac, NoiseAveragesOutOverTheInliers) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const auto matches = make_matches(kScaled, 150, 0.7, 0.01, 0.4, seed);
    const auto result = estimate_similarity_ransac({}, kCamera, true, matches);
    ASSERT_TRUE(result.success) << seed;
    EXPECT_LT((result.b_from_a * kScaled.inverse()).log().norm(), 0.02) << seed;
  }
}

TEST(SimilarityRansac, RefinementReachesTheSameFromNearby) {
  const auto matches = make_matches(kScaled, 100, 0, 0, 0.3, 4);
  Vec7 nudge;
  nudge << 0.004, -0.003, 0.002, 0.001, 0.001, -0.001, 0.003;
  const auto result = refine_similarity({}, kCamera, true, matches, Sim3::exp(nudge) * kScaled);
  EXPECT_GE(result.num_inliers, 70);
  EXPECT_LT((result.b_from_a * kScaled.inverse()).log().norm(), 1e-9);
}

TEST(SimilarityRansac, RandomPairsAgreeOnNothing) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    auto matches = make_matches(kScaled, 60, 0, 0, 0, seed);
    const auto others = make_matches(kScaled, 60, 0, 0, 0, seed + 100);
    for (size_t i = 0; i < matches.size(); ++i) {
      matches[i].point_in_b = others[i].point_in_b;
      matches[i].pixel_in_b = others[i].pixel_in_b;
    }
    EXPECT_FALSE(estimate_similarity_ransac({}, kCamera, true, matches).success) << seed;
  }
  EXPECT_FALSE(estimate_similarity_ransac({}, kCamera, true, {}).success);
}

}  // namespace
}  // namespace photoslam
