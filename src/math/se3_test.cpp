// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "math/se3.h"

#include <gtest/gtest.h>

#include <unsupported/Eigen/MatrixFunctions>

#include "base/random.h"

namespace photoslam {
namespace {

Vec6 random_twist(Random& random, double angle_scale) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = random.uniform(-1, 1);
  twist.tail<3>() *= angle_scale;
  return twist;
}

/// The matrix of a twist in the Lie algebra se(3).
Eigen::Matrix4d twist_matrix(const Vec6& twist) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.topLeftCorner<3, 3>() = hat(twist.tail<3>());
  m.topRightCorner<3, 1>() = twist.head<3>();
  return m;
}

TEST(SE3, ExpAgreesWithTheMatrixExponential) {
  Random random(1);
  for (double scale : {1e-9, 1e-5, 1e-3, 0.1, 1.7}) {
    const Vec6 twist = random_twist(random, scale);
    EXPECT_LT((SE3::exp(twist).matrix() - twist_matrix(twist).exp()).norm(), 1e-12) << scale;
  }
}

TEST(SE3, LogInvertsExp) {
  Random random(2);
  for (double scale : {0.0, 1e-10, 1e-6, 1e-2, 1.0, 1.8}) {
    const Vec6 twist = random_twist(random, scale);
    EXPECT_LT((SE3::exp(twist).log() - twist).norm(), 1e-9) << scale;
  }
}

TEST(SE3, GroupAxioms) {
  Random random(3);
  const SE3 a = SE3::exp(random_twist(random, 1)), b = SE3::exp(random_twist(random, 1));
  const Vec3 x(0.3, -2, 5);
  EXPECT_LT(((a * b) * x - a * (b * x)).norm(), 1e-12);
  EXPECT_LT((a.inverse() * (a * x) - x).norm(), 1e-12);
  EXPECT_LT((SE3::from_matrix(a.matrix()).matrix() - a.matrix()).norm(), 1e-12);
  EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-12);
}

TEST(SO3, LogOfTheNegatedQuaternionIsTheSame) {
  const Quat q = so3_exp(Vec3(0.2, -0.4, 0.1));
  EXPECT_LT((so3_log(q) - so3_log(Quat(-q.coeffs()))).norm(), 1e-14);
}

}  // namespace
}  // namespace photoslam
