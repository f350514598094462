// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/view_geometry.h"

#include <algorithm>

namespace photoslam {

splatting::Camera to_splatting(const PinholeCamera& camera) {
  return {camera.width,
          camera.height,
          static_cast<float>(camera.fx),
          static_cast<float>(camera.fy),
          static_cast<float>(camera.cx),
          static_cast<float>(camera.cy)};
}

ImageF to_image(const splatting::RenderResult& render) {
  ImageF image(render.width, render.height, 3);
  const size_t plane = render.alpha.size();
  const std::span<float> out = image.values();
  for (size_t i = 0; i < plane; ++i) {
    for (size_t c = 0; c < 3; ++c) out[3 * i + c] = std::clamp(render.rgb[c * plane + i], 0.0f, 1.0f);
  }
  return image;
}

void camera_from_anchors(const SE3& camera_from_world, std::span<const SE3> anchors_from_world,
                         std::vector<splatting::Pose>& camera_from_anchor) {
  camera_from_anchor.resize(anchors_from_world.size());
  for (size_t i = 0; i < anchors_from_world.size(); ++i) {
    const SE3 pose = camera_from_world * anchors_from_world[i].inverse();
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(camera_from_anchor[i].rotation) = pose.matrix3();
    Eigen::Map<Vec3>(camera_from_anchor[i].translation) = pose.translation;
  }
}

Vec3 in_camera(const splatting::Pose& camera_from_anchor, const splatting::Gaussian& gaussian) {
  const Vec3 mean(static_cast<double>(gaussian.mean[0]), static_cast<double>(gaussian.mean[1]),
                  static_cast<double>(gaussian.mean[2]));
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(camera_from_anchor.rotation) * mean +
         Eigen::Map<const Vec3>(camera_from_anchor.translation);
}

}  // namespace photoslam
