// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "math/umeyama.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/check.h"
#include "base/random.h"

namespace photoslam {
namespace {

std::vector<Vec3> random_points(int count, const Vec3& extent, uint64_t seed) {
  Random random(seed);
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)).cwiseProduct(extent));
  }
  return points;
}

const Sim3 kTruth{1.7, so3_exp(Vec3(0.4, -1.2, 2.1)), Vec3(3, -5, 0.5)};

double squared_error(const Sim3& s, const std::vector<Vec3>& source, const std::vector<Vec3>& target) {
  double sum = 0;
  for (size_t i = 0; i < source.size(); ++i) sum += (s * source[i] - target[i]).squaredNorm();
  return sum;
}

TEST(Umeyama, RecoversASimilarity) {
  // Also from points in a plane, which a reflection would fit as well.
  for (const Vec3& extent : {Vec3(1, 2, 3), Vec3(1, 2, 0)}) {
    const auto source = random_points(20, extent, 1);
    std::vector<Vec3> target;
    for (const Vec3& x : source) target.push_back(kTruth * x);
    const Sim3 found = align_umeyama(source, target, true);
    EXPECT_NEAR(found.scale, kTruth.scale, 1e-12);
    EXPECT_LT((found * kTruth.inverse()).log().norm(), 1e-10);
  }
}

TEST(Umeyama, NoNearbyTransformIsBetter) {
  const auto source = random_points(30, Vec3(1, 1, 1), 2), noise = random_points(30, Vec3(0.2, 0.2, 0.2), 3);
  std::vector<Vec3> target;
  for (size_t i = 0; i < source.size(); ++i) target.push_back(kTruth * source[i] + noise[i]);
  for (bool with_scale : {true, false}) {
    const Sim3 best = align_umeyama(source, target, with_scale);
    EXPECT_TRUE(with_scale || best.scale == 1.0);
    const double least = squared_error(best, source, target);
    for (int k = 0; k < (with_scale ? 7 : 6); ++k) {
      for (double step : {1e-3, -1e-3}) {
        const Sim3 other = Sim3::exp(step * Vec7::Unit(k)) * best;
        EXPECT_GT(squared_error(other, source, target), least) << k;
      }
    }
  }
}

TEST(Umeyama, DegenerateInputGivesAFiniteBestFit) {
  const std::vector<Vec3> one = {Vec3(1, 2, 3)}, other = {Vec3(-1, 0, 5)};
  EXPECT_LT((align_umeyama(one, other, true) * one[0] - other[0]).norm(), 1e-12);
  const std::vector<Vec3> line = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0)};
  const std::vector<Vec3> turned = {Vec3(5, 0, 0), Vec3(5, 1, 0), Vec3(5, 2, 0)};
  EXPECT_LT(squared_error(align_umeyama(line, turned, false), line, turned), 1e-20);
  EXPECT_THROW(align_umeyama(line, one, false), CheckError);
}

}  // namespace
}  // namespace photoslam
