// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "sources/camera_file.h"

namespace photoslam {

/// Reads a calibration of any of the known layouts, told apart by content: camera.yaml, EuRoC's sensor.yaml, KITTI's
/// calib.txt (the grey cameras), OpenCV's and ROS' YAML, ORB-SLAM's settings. The error says what was looked for.
///
/// The size of the images is 0 where the file does not tell it.
Result<CameraFile> read_calibration(const std::filesystem::path& path);

/// A camera without distortion of the given horizontal field of view, its axis through the middle of the image. A
/// guess: whoever uses it must say so.
CameraFile guess_camera(double fov_deg, int width, int height);

namespace internal {

/// The calibration a user chose: a file, or a field of view; nothing where neither is given. `width` and `height` are
/// those of the images. Notes what was guessed.
Result<std::optional<CameraFile>> chosen_camera(const std::filesystem::path& file, double fov_deg, int width,
                                                int height, std::vector<std::string>& notes);

/// Hands a calibration to a source whose sensor is known. A stereo sensor needs a second camera.
Status apply_camera(const CameraFile& file, const std::string& where, SourceInfo& info);

}  // namespace internal
}  // namespace photoslam
