// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "math/sim3.h"

#include <array>
#include <cmath>

namespace photoslam {
namespace {

double sinc(double x) { return std::abs(x) < 1e-4 ? 1.0 - x * x / 6.0 : std::sin(x) / x; }

/// ∫₀¹ exp(u (σ + ω×)) du, the matrix that turns the translational tangent into the translation. By Gauss-Legendre
/// quadrature with ten points, exact to rounding for |σ|, |ω| ≤ π: the closed form has four removable singularities.
Mat3 mean_exponential(const Vec3& omega, double sigma) {
  constexpr std::array<double, 5> kNode{0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845,
                                        0.9739065285171717};
  constexpr std::array<double, 5> kWeight{0.2955242247147529, 0.2692667193099963, 0.2190863625159821,
                                          0.1494513491505806, 0.0666713443086881};
  const double theta = omega.norm();
  double identity = 0, linear = 0, quadratic = 0;
  for (size_t i = 0; i < kNode.size(); ++i) {
    for (const double side : {-1.0, 1.0}) {
      const double u = 0.5 * (1.0 + side * kNode[i]);
      const double weight = 0.5 * kWeight[i] * std::exp(sigma * u);
      const double half = sinc(0.5 * theta * u);
      identity += weight;
      linear += weight * u * sinc(theta * u);
      quadratic += weight * 0.5 * u * u * half * half;  // (1 − cos θu) / θ²
    }
  }
  const Mat3 w = hat(omega);
  return identity * Mat3::Identity() + linear * w + quadratic * w * w;
}

/// The matrix of the Lie bracket: ad(ξ) η = [ξ, η].
Mat7 bracket(const Vec7& tangent) {
  const Vec3 v = tangent.head<3>(), omega = tangent.segment<3>(3);
  Mat7 ad = Mat7::Zero();
  ad.topLeftCorner<3, 3>() = hat(omega) + tangent[6] * Mat3::Identity();
  ad.block<3, 3>(0, 3) = hat(v);
  ad.topRightCorner<3, 1>() = -v;
  ad.block<3, 3>(3, 3) = hat(omega);
  return ad;
}

}  // namespace

Sim3 Sim3::operator*(const Sim3& other) const {
  return {scale * other.scale, (rotation * other.rotation).normalized(), *this * other.translation};
}

Sim3 Sim3::inverse() const {
  const Quat r = rotation.conjugate();
  return {1.0 / scale, r, -(r * translation) / scale};
}

Eigen::Matrix4d Sim3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = scale * rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Sim3 Sim3::exp(const Vec7& tangent) {
  const Vec3 omega = tangent.segment<3>(3);
  return {std::exp(tangent[6]), so3_exp(omega), mean_exponential(omega, tangent[6]) * tangent.head<3>()};
}

Vec7 Sim3::log() const {
  const Vec3 omega = so3_log(rotation);
  const double sigma = std::log(scale);
  Vec7 tangent;
  tangent << mean_exponential(omega, sigma).inverse() * translation, omega, sigma;
  return tangent;
}

Mat7 Sim3::adjoint() const {
  const Mat3 r = rotation.toRotationMatrix();
  Mat7 m = Mat7::Zero();
  m.topLeftCorner<3, 3>() = scale * r;
  m.block<3, 3>(0, 3) = hat(translation) * r;
  m.topRightCorner<3, 1>() = -translation;
  m.block<3, 3>(3, 3) = r;
  m(6, 6) = 1;
  return m;
}

Mat7 sim3_inverse_left_jacobian(const Vec7& tangent) {
  // Σ Bₙ/n! adⁿ with the Bernoulli numbers; odd ones beyond the first are zero.
  constexpr std::array<double, 7> kEven{
      1.0 / 12, -1.0 / 720, 1.0 / 30240, -1.0 / 1209600, 1.0 / 47900160, -691.0 / 1307674368000.0, 1.0 / 74724249600.0};
  const Mat7 ad = bracket(tangent), squared = ad * ad;
  Mat7 result = Mat7::Identity() - 0.5 * ad;
  Mat7 power = squared;
  for (const double coefficient : kEven) {
    result += coefficient * power;
    power *= squared;
  }
  return result;
}

}  // namespace photoslam
