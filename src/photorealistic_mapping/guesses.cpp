// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/guesses.h"

#include <cmath>

#include "photorealistic_mapping/view_geometry.h"

namespace photoslam {
namespace {

/// Measured depth of the pixel that shows the point [m]; 0 = none.
double depth_at(const DepthPicture& view, const Vec3& point) {
  const Vec2 pixel = view.camera.project(point);
  if (!view.camera.contains(pixel)) return 0;
  return static_cast<double>(
      view.depth(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y()))));
}

}  // namespace

size_t settle_guesses(const DepthPicture& view, std::span<const splatting::Pose> camera_from_anchor, double near_m,
                      double tolerance, splatting::GaussianModel& model) {
  if (view.depth.empty() || tolerance <= 0) return 0;
  return model.remove_if([&](size_t i) {
    if (model.tag(i) != kGuessTag) return false;
    const Vec3 p = in_camera(camera_from_anchor[static_cast<size_t>(model.anchor(i))], model.get(i));
    if (!(p.z() > near_m)) return false;
    const double depth = depth_at(view, p);
    if (!(depth > 0) || p.z() > (1 + tolerance) * depth) return false;
    if (p.z() < (1 - tolerance) * depth) return true;
    model.set_tag(i, 0);
    return false;
  });
}

}  // namespace photoslam
