// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "sources/calibration/yaml_map.h"
#include "sources/camera_file.h"

/// Calibrations in the YAML layouts of other programs. Errors name file and line.
namespace photoslam::internal {

/// OpenCV's FileStorage and ROS' camera_info: camera_matrix, distortion_coefficients (matrices or lists), image_width,
/// image_height, distortion_model (plumb_bob, rational_polynomial, equidistant) or fisheye_model (0 or 1). Four
/// coefficients without either are an error: they may be of both kinds of lens.
bool is_opencv_calibration(const YamlMap& map);
Result<CameraFile> read_opencv_calibration(YamlMap& map);

/// A pair of cameras as OpenCV's stereo sample has it, intrinsics and extrinsics in one file: M1, D1, M2, D2 and R, T,
/// which take the first camera to the second, T in metres; image_width, image_height and the lens as above.
bool is_opencv_stereo(const YamlMap& map);
Result<CameraFile> read_opencv_stereo(YamlMap& map);

/// Settings of the ORB-SLAM family: Camera.fx or Camera1.fx …, Camera.type (PinHole, Rectified, KannalaBrandt8),
/// Camera.width, height, fps; DepthMapFactor. A second camera comes from Camera.bf or Stereo.b (rectified images), from
/// Stereo.T_c1_c2 with Camera2.*, or from LEFT.K, LEFT.D, LEFT.R, RIGHT.K, RIGHT.D, RIGHT.R, RIGHT.P.
bool is_orb_slam_settings(const YamlMap& map);
Result<CameraFile> read_orb_slam_settings(YamlMap& map);

}  // namespace photoslam::internal
