// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>

#include "base/result.h"
#include "math/se3.h"

namespace photoslam {

/// A rectified camera of KITTI: its projection P = K [I | t].
struct KittiCamera {
  double fx = 0, fy = 0, cx = 0, cy = 0;  // px
  Vec3 camera_from_cam0 = Vec3::Zero();   // translation [m]; there is no rotation
};

/// Reads calib.txt: lines "P0: 12 numbers" (row-major 3x4), by camera number. Other lines are left alone.
Result<std::map<int, KittiCamera>> read_kitti_calib(const std::filesystem::path& path);

}  // namespace photoslam
