// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/lighting/light.h"

#include <cmath>
#include <numbers>

namespace photoslam::synthetic {

std::pair<Vec3f, Vec3f> orthogonal_axes(const Vec3f& n) {
  const float sign = std::copysign(1.0f, n.z());
  const float a = -1.0f / (sign + n.z()), b = n.x() * n.y() * a;
  return {Vec3f(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x()), Vec3f(b, sign + n.y() * n.y() * a, -n.y())};
}

float AreaLight::area() const {
  return is_ball() ? std::numbers::pi_v<float> * radius * radius : 4 * half_u.cross(half_v).norm();
}

Vec3f AreaLight::point(float a, float b, const Vec3f& seen_from) const {
  if (!is_ball()) return center + a * half_u + b * half_v;
  const Vec3f towards = (seen_from - center).normalized();
  const auto [x, y] = orthogonal_axes(towards);
  return center + radius * (1.05f * towards + a * x + b * y);
}

}  // namespace photoslam::synthetic
