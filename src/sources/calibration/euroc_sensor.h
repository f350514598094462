// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "sources/camera_file.h"

namespace photoslam {

/// A camera of an EuRoC ASL sequence as its sensor.yaml describes it.
struct EurocSensor {
  CameraFile file;
  SE3 body_from_camera;  ///< T_BS.
};

/// Reads sensor.yaml: camera_model (pinhole), intrinsics [fu, fv, cu, cv], resolution, distortion_model
/// (radial-tangential or equidistant), distortion_coefficients, T_BS, rate_hz. Errors name file and line.
Result<EurocSensor> read_euroc_sensor(const std::filesystem::path& path);

/// T_BS alone, which any sensor has; the identity where the file does not give it.
Result<SE3> read_body_from_sensor(const std::filesystem::path& path);

}  // namespace photoslam
