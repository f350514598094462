// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "image/rectification.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace photoslam {
namespace {

/// Whether the raw images are rectified already, up to what calibration files round away.
bool is_rectified(const CalibratedCamera& left, const CalibratedCamera& right, const SE3& right_from_left) {
  constexpr double kMaxPixels = 0.01, kMaxRadians = 1e-5;
  const PinholeCamera &a = left.camera, &b = right.camera;
  const bool equal = a.width == b.width && a.height == b.height &&
                     std::max({std::abs(a.fx - a.fy), std::abs(a.fx - b.fx), std::abs(a.fy - b.fy),
                               std::abs(a.cx - b.cx), std::abs(a.cy - b.cy)}) < kMaxPixels;
  const Vec3& t = right_from_left.translation;
  return left.distortion.none() && right.distortion.none() && equal &&
         so3_log(right_from_left.rotation).norm() < kMaxRadians && t.tail<2>().norm() < kMaxRadians * -t.x();
}

/// Mean direction, as a point on the plane z = 1 of the turned camera, of what the lens sees at the border of its
/// image.
Vec2 mean_border(const CalibratedCamera& lens, const Quat& rectified_from_lens) {
  const PinholeCamera& camera = lens.camera;
  Vec2 sum = Vec2::Zero();
  int count = 0;
  constexpr int kSteps = 32;
  for (int i = 0; i < 4 * kSteps; ++i) {
    const double along = static_cast<double>(i % kSteps) / kSteps;
    const Vec2 corners[5] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
    const Vec2 unit = corners[i / kSteps] + along * (corners[i / kSteps + 1] - corners[i / kSteps]);
    const Vec2 pixel(unit.x() * (camera.width - 1), unit.y() * (camera.height - 1));
    const auto point =
        undistort(lens.distortion, {(pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy});
    if (!point) continue;
    const Vec3 ray = rectified_from_lens * Vec3(point->x(), point->y(), 1);
    constexpr double kWidest = 0.1;  // directions near 90° off the axis would dominate the mean
    if (ray.z() < kWidest) continue;
    sum += ray.head<2>() / ray.z();
    ++count;
  }
  return count > 0 ? Vec2(sum / count) : Vec2::Zero();
}

}  // namespace

StereoRectification rectify_stereo(const CalibratedCamera& left, const CalibratedCamera& right,
                                   const SE3& right_from_left) {
  StereoRectification result;
  const Vec3 right_in_left = right_from_left.inverse().translation;
  result.baseline_m = right_in_left.norm();
  PHOTOSLAM_CHECK(result.baseline_m > 0, "both cameras are at the same place");
  if (is_rectified(left, right, right_from_left)) {
    result.camera = left.camera;
    result.is_identity = true;
    return result;
  }

  // Halfway between both orientations, then the shortest turn that puts the baseline on the x axis.
  const Quat half_from_left = so3_exp(0.5 * so3_log(right_from_left.rotation));
  const Quat level = Quat::FromTwoVectors(half_from_left * right_in_left, Vec3::UnitX());
  result.rectified_from_left = (level * half_from_left).normalized();
  result.rectified_from_right = (result.rectified_from_left * right_from_left.rotation.inverse()).normalized();

  const PinholeCamera &a = left.camera, &b = right.camera;
  const double focal = 0.25 * (a.fx + a.fy + b.fx + b.fy);
  const Vec2 center =
      0.5 * (mean_border(left, result.rectified_from_left) + mean_border(right, result.rectified_from_right));
  result.camera = {a.width,
                   a.height,
                   focal,
                   focal,
                   0.5 * (a.width - 1) - focal * center.x(),
                   0.5 * (a.height - 1) - focal * center.y()};
  return result;
}

}  // namespace photoslam
