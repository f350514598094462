// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "base/result.h"
#include "camera/distortion.h"
#include "camera/pinhole.h"

namespace photoslam {

/// A camera at a known place, and the image it took.
struct PosedCamera {
  PinholeCamera camera;
  SE3 camera_from_world;
  std::filesystem::path image;  ///< May not exist.
  Distortion distortion = {};   ///< Of the lens that took it.
};

/// A camera whose intrinsics make sense; the error says which do not.
Result<PinholeCamera> checked_camera(double width, double height, double fx, double fy, double cx, double cy);

/// Reads nerfstudio's transforms.json: intrinsics (fl_x, fl_y, cx, cy, w, h) and distortion (k1, k2, k3, p1, p2; with
/// camera_model OPENCV_FISHEYE k1 to k4), each for all frames or per frame, and world_from_camera matrices in OpenGL
/// axes (y up, z backwards), converted to ours. Its pixel centres lie at +½.
Result<std::vector<PosedCamera>> read_transforms_json(const std::filesystem::path& path);

/// Writes such a file, with intrinsics per frame and image paths relative to its folder; atomically. The cameras are
/// without distortion.
Status write_transforms_json(const std::filesystem::path& path, std::span<const PosedCamera> cameras);

/// A point of a sparse model.
struct SparsePoint {
  Vec3 position = Vec3::Zero();  ///< World frame.
  uint8_t color[3] = {128, 128, 128};
};

/// Writes a COLMAP model as text into a folder (cameras.txt, images.txt, points3D.txt), so that every trainer of
/// gaussians can take over; COLMAP's pixel centres lie at +½. One camera for each different calibration, without
/// distortion.
Status write_colmap_model(const std::filesystem::path& folder, std::span<const PosedCamera> cameras,
                          std::span<const SparsePoint> points);

/// Where a COLMAP dataset keeps its model: sparse/0, sparse or the folder itself; empty: nowhere.
std::filesystem::path find_colmap_model(const std::filesystem::path& dataset);

/// Reads the cameras of a COLMAP model, in binary form if it is there, else as text; images are looked for in `images`.
/// In the order of the images' names. Errors name file and line, or byte.
Result<std::vector<PosedCamera>> read_colmap_cameras(const std::filesystem::path& folder,
                                                     const std::filesystem::path& images);

/// Reads its points3D, in the same form.
Result<std::vector<SparsePoint>> read_colmap_points(const std::filesystem::path& folder);

}  // namespace photoslam
