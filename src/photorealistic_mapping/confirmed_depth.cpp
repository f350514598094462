// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/confirmed_depth.h"

#include <algorithm>
#include <cmath>

namespace photoslam {
namespace {

bool agrees(const MeasuredView& other, const Vec3& point_in_view, double tolerance) {
  const Vec3 point = other.other_from_view * point_in_view;
  if (!(point.z() > 0)) return false;
  const PinholeCamera& camera = other.picture->camera;
  const Vec2 pixel = camera.project(point);
  if (!camera.contains(pixel)) return false;
  const auto measured = static_cast<double>(
      other.picture->depth(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y()))));
  return measured > 0 && std::abs(point.z() - measured) <= tolerance * measured;
}

}  // namespace

ImageF confirmed_depth(const DepthPicture& view, std::span<const MeasuredView> others, double tolerance) {
  ImageF confirmed(view.camera.width, view.camera.height, 1);
  for (int y = 0; y < view.camera.height; ++y) {
    for (int x = 0; x < view.camera.width; ++x) {
      const float depth = view.depth(x, y);
      if (!(depth > 0)) continue;
      const Vec3 point = view.camera.unproject(Vec2(x, y), static_cast<double>(depth));
      const bool is_confirmed =
          std::ranges::any_of(others, [&](const MeasuredView& other) { return agrees(other, point, tolerance); });
      if (is_confirmed) confirmed(x, y) = depth;
    }
  }
  return confirmed;
}

}  // namespace photoslam
