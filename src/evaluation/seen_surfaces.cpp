// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/seen_surfaces.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace photoslam {

ImageF SeenSurfaces::sampled(const ImageU16& depth) const {
  PHOTOSLAM_CHECK(depth.width() == camera_.width && depth.height() == camera_.height, "{}x{}", depth.width(),
                  depth.height());
  ImageF samples((depth.width() + kStep - 1) / kStep, (depth.height() + kStep - 1) / kStep);
  for (int y = 0; y < samples.height(); ++y) {
    for (int x = 0; x < samples.width(); ++x) {
      samples(x, y) = static_cast<float>(metres_per_depth_unit_ * depth(kStep * x, kStep * y));
    }
  }
  return samples;
}

void SeenSurfaces::add_view(const SE3& camera_from_world, const ImageU16& depth) {
  views_.push_back({camera_from_world, sampled(depth)});
}

bool SeenSurfaces::is_seen(const Vec3& in_world) const {
  return std::ranges::any_of(views_, [&](const View& view) {
    const Vec3 x = view.camera_from_world * in_world;
    if (x.z() <= 0) return false;
    const Vec2 pixel = camera_.project(x);
    if (!camera_.contains(pixel)) return false;
    const auto column = std::clamp(static_cast<int>(std::lround(pixel.x() / kStep)), 0, view.depth.width() - 1);
    const auto row = std::clamp(static_cast<int>(std::lround(pixel.y() / kStep)), 0, view.depth.height() - 1);
    return std::abs(static_cast<double>(view.depth(column, row)) - x.z()) < kTolerance * x.z();
  });
}

ImageU8 SeenSurfaces::mask(const SE3& camera_from_world, const ImageU16& depth) const {
  const ImageF samples = sampled(depth);
  const SE3 world_from_camera = camera_from_world.inverse();
  ImageU8 mask(depth.width(), depth.height(), 1, 0);
  for (int y = 0; y < samples.height(); ++y) {
    for (int x = 0; x < samples.width(); ++x) {
      const auto z = static_cast<double>(samples(x, y));
      if (!(z > 0) || !is_seen(world_from_camera * camera_.unproject(Vec2(kStep * x, kStep * y), z))) continue;
      for (int row = kStep * y; row < std::min(kStep * (y + 1), mask.height()); ++row) {
        for (int column = kStep * x; column < std::min(kStep * (x + 1), mask.width()); ++column)
          mask(column, row) = 255;
      }
    }
  }
  return mask;
}

}  // namespace photoslam
