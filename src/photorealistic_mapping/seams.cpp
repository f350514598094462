// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/seams.h"

#include <algorithm>
#include <limits>

namespace photoslam {
namespace {

Sim3 anchor_from_world(const Keyframe& keyframe) {
  return anchor_from_world(keyframe.camera_from_world, keyframe.scale);
}

/// How far things at this depth move in the picture, at most, when what was at `p` comes to lie at `moved * p`.
double largest_shift_px(const PinholeCamera& camera, double depth, const Sim3& moved) {
  double largest = 0;
  for (const double x : {0.25, 0.75}) {
    for (const double y : {0.25, 0.75}) {
      const Vec2 pixel(x * camera.width, y * camera.height);
      const Vec3 now = moved * camera.unproject(pixel, depth);
      if (!(now.z() > 0)) return std::numeric_limits<double>::infinity();
      largest = std::max(largest, (camera.project(now) - pixel).norm());
    }
  }
  return largest;
}

}  // namespace

Sim3 anchor_from_world(const SE3& camera_from_world, double scale) {
  return {1 / scale, camera_from_world.rotation, camera_from_world.translation / scale};
}

std::vector<int> find_seams(double min_shift_px, const PinholeCamera& camera, const MapSnapshot& after,
                            std::span<const Sim3> before) {
  std::vector<int> seams;
  for (size_t k = 0; k < before.size(); ++k) {
    const KeyframeView& view = *after.keyframes[k];
    const Sim3 here_from_world = anchor_from_world(view.keyframe);
    const double depth = view.median_depth / view.keyframe.scale;
    const bool is_seam =
        depth > 0 && std::ranges::any_of(view.covisible, [&](const CovisibleKeyframe& other) {
          const auto j = static_cast<size_t>(other.keyframe.value);
          if (j >= before.size()) return false;
          const Sim3 other_from_here_before = before[j] * before[k].inverse();
          const Sim3 here_from_other_now =
              here_from_world * anchor_from_world(after.keyframe(other.keyframe).keyframe).inverse();
          return largest_shift_px(camera, depth, here_from_other_now * other_from_here_before) > min_shift_px;
        });
    if (is_seam) seams.push_back(static_cast<int>(k));
  }
  return seams;
}

}  // namespace photoslam
