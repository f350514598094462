// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "camera/pinhole.h"
#include "image/image.h"
#include "math/se3.h"

namespace photoslam {

/// What a camera has seen of a scene, by true poses and measured depth: where later views can be held against a map
/// that was made of the earlier ones. Judged in steps of kStep pixels.
class SeenSurfaces {
 public:
  static constexpr int kStep = 4;
  static constexpr double kTolerance = 0.05;  ///< Share of the distance by which depths of one surface may differ.

  /// `metres_per_depth_unit` of all depth images, which are of undistorted pictures of this camera; 0 = not measured.
  SeenSurfaces(const PinholeCamera& camera, double metres_per_depth_unit)
      : camera_(camera), metres_per_depth_unit_(metres_per_depth_unit) {}

  void add_view(const SE3& camera_from_world, const ImageU16& depth);

  /// 255 where a pixel shows a surface that some view saw; elsewhere and where nothing was measured 0.
  ImageU8 mask(const SE3& camera_from_world, const ImageU16& depth) const;

 private:
  struct View {
    SE3 camera_from_world;
    ImageF depth;  // [m], every kStep-th pixel
  };
  ImageF sampled(const ImageU16& depth) const;
  bool is_seen(const Vec3& in_world) const;

  PinholeCamera camera_;
  double metres_per_depth_unit_;
  std::vector<View> views_;
};

}  // namespace photoslam
