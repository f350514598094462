// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "math/sim3.h"

#include <gtest/gtest.h>

#include <unsupported/Eigen/MatrixFunctions>

#include "base/random.h"

namespace photoslam {
namespace {

Vec7 random_tangent(Random& random, double angle_scale = 1, double log_scale = 1) {
  Vec7 tangent;
  for (int i = 0; i < 7; ++i) tangent[i] = random.uniform(-1, 1);
  tangent.segment<3>(3) *= angle_scale;
  tangent[6] *= log_scale;
  return tangent;
}

/// The matrix of a tangent in the Lie algebra sim(3).
Eigen::Matrix4d tangent_matrix(const Vec7& tangent) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.topLeftCorner<3, 3>() = hat(tangent.segment<3>(3)) + tangent[6] * Mat3::Identity();
  m.topRightCorner<3, 1>() = tangent.head<3>();
  return m;
}

TEST(Sim3, ExpAgreesWithTheMatrixExponential) {
  Random random(1);
  for (const double angle : {0.0, 1e-9, 1e-5, 1e-3, 0.1, 1.7}) {
    for (const double log_scale : {0.0, 1e-9, 1e-4, 0.1, 1.5}) {
      const Vec7 tangent = random_tangent(random, angle, log_scale);
      EXPECT_LT((Sim3::exp(tangent).matrix() - tangent_matrix(tangent).exp()).norm(), 1e-12) << angle << log_scale;
    }
  }
}

TEST(Sim3, LogInvertsExp) {
  Random random(2);
  for (const double angle : {0.0, 1e-10, 1e-6, 1e-2, 1.0, 1.8}) {
    const Vec7 tangent = random_tangent(random, angle);
    EXPECT_LT((Sim3::exp(tangent).log() - tangent).norm(), 1e-9) << angle;
  }
}

TEST(Sim3, GroupAxioms) {
  Random random(3);
  const Sim3 a = Sim3::exp(random_tangent(random)), b = Sim3::exp(random_tangent(random));
  const Vec3 x(0.3, -2, 5);
  EXPECT_LT(((a * b) * x - a * (b * x)).norm(), 1e-12);
  EXPECT_LT((a.inverse() * (a * x) - x).norm(), 1e-12);
  EXPECT_LT(((a * b).matrix() - a.matrix() * b.matrix()).norm(), 1e-12);
}

TEST(Sim3, AdjointMovesATangentThroughATransform) {
  Random random(4);
  const Sim3 s = Sim3::exp(random_tangent(random));
  const Vec7 tangent = random_tangent(random, 0.5);
  const Sim3 direct = s * Sim3::exp(tangent) * s.inverse();
  EXPECT_LT((Sim3::exp(s.adjoint() * tangent).matrix() - direct.matrix()).norm(), 1e-12);
}

TEST(Sim3, InverseJacobiansAgreeWithFiniteDifferences) {
  Random random(5);
  constexpr double kStep = 1e-6;
  for (const double angle : {1e-6, 0.1, 0.5, 0.9}) {
    const Vec7 tangent = random_tangent(random, angle, 0.3);
    const Sim3 s = Sim3::exp(tangent);
    Mat7 left, right;
    for (int i = 0; i < 7; ++i) {
      const Sim3 forward = Sim3::exp(kStep * Vec7::Unit(i)), backward = Sim3::exp(-kStep * Vec7::Unit(i));
      left.col(i) = ((forward * s).log() - (backward * s).log()) / (2 * kStep);
      right.col(i) = ((s * forward).log() - (s * backward).log()) / (2 * kStep);
    }
    EXPECT_LT((sim3_inverse_left_jacobian(tangent) - left).norm(), 1e-6) << angle;
    EXPECT_LT((sim3_inverse_left_jacobian(-tangent) - right).norm(), 1e-6) << angle;
  }
}

TEST(Sim3, RigidKeepsTheProjectionOfEveryPoint) {
  Random random(6);
  const Sim3 camera_from_world = Sim3::exp(random_tangent(random));
  const Vec3 point(0.3, -0.2, 4);
  const Vec3 a = camera_from_world * point, b = camera_from_world.rigid() * point;
  EXPECT_LT((a.normalized() - b.normalized()).norm(), 1e-14);
}

}  // namespace
}  // namespace photoslam
