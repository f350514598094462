// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace photoslam::splatting {

/// Rigid transform camera_from_anchor, composed by the caller in double precision.
struct Pose {
  double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< Row-major.
  double translation[3] = {0, 0, 0};                 ///< [m]
};

/// Pinhole camera without distortion; pixel centres lie at integer coordinates.
struct Camera {
  int width = 0, height = 0;  ///< [px]
  float fx = 0, fy = 0, cx = 0, cy = 0;
};

/// A camera and where it is, seen from every anchor of the model.
struct View {
  Camera camera;
  std::span<const Pose> camera_from_anchor;  // [anchors]
};

struct RenderOptions {
  float near = 0.01f;  ///< Gaussians whose centre lies at z <= near are not drawn [m].
  /// The picture is a larger one shrunk by this: each pixel the mean of so many² of its pixels, as gaussians, too, are
  /// drawn.
  int shrink_factor = 1;
  float background[3] = {0, 0, 0};
  int sh_degree = 3;  ///< At most this degree; the model's own degree is the other bound.
};

}  // namespace photoslam::splatting
