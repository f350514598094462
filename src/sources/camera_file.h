// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "camera/distortion.h"
#include "camera/pinhole.h"
#include "sources/frame.h"

namespace photoslam {

/// Calibration of a camera as its file gives it.
struct CameraFile {
  PinholeCamera camera;
  Distortion distortion;
  std::optional<double> frames_per_second = {};
  std::optional<double> depth_scale = {};  ///< Stored depth value / depth_scale = metres.
  std::optional<RightCamera> right = {};   ///< Of stereo rigs, where the file tells.
  bool is_guess = false;                   ///< Of a field of view: there is no file.
};

/// Reads `camera.yaml`: width, height, fx, fy, cx, cy [px], and optionally model (pinhole or fisheye), distortion (a
/// list of 4, 5 or 8 coefficients k1 k2 p1 p2 k3 k4 k5 k6 of a pinhole, of 4 coefficients k1 k2 k3 k4 of a fisheye, or
/// empty), fps, depth_scale.
///
/// Missing, unknown (with the nearest known one) and senseless values are errors with file and line.
Result<CameraFile> read_camera_yaml(const std::filesystem::path& path);

/// The text of a camera.yaml of one camera.
std::string camera_yaml(const CameraFile& file);

}  // namespace photoslam
