// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "camera/pinhole.h"

namespace photoslam {

/// A camera at a known place, and the image it took.
struct PosedCamera {
  PinholeCamera camera;
  SE3 camera_from_world;
  std::filesystem::path image;  ///< May not exist.
};

/// Reads nerfstudio's transforms.json: intrinsics (fl_x, fl_y, cx, cy, w, h; for all frames or per frame) and
/// world_from_camera matrices in OpenGL axes (y up, z backwards), converted to ours. Its pixel centres lie at +½.
/// Distortion other than zero is an error: such images have to be undistorted first.
Result<std::vector<PosedCamera>> read_transforms_json(const std::filesystem::path& path);

}  // namespace photoslam
