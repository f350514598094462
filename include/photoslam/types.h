// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace photoslam {

/// Thrown by the functions of include/photoslam when the environment fails them (files, bad arguments): the message
/// says what, where and what to do. Bad frames are never an exception; they are counted.
class Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A camera as calibration gives it. Pixel centres lie at integer coordinates, lengths in pixels; axes x right, y down,
/// z forward.
struct CameraModel {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::array<double, 5> distortion{};  ///< k1, k2, p1, p2, k3 as in OpenCV.
};

/// Where a camera was. The world frame is that of the first camera.
struct CameraPose {
  int64_t timestamp_ns = 0;
  std::array<double, 3> position{};               ///< Of the camera in the world [m].
  std::array<double, 4> orientation{1, 0, 0, 0};  ///< world_from_camera as unit quaternion w, x, y, z.
};

/// One picture with depth, registered to each other.
struct RgbdFrame {
  int64_t timestamp_ns = 0;     ///< Must increase from frame to frame.
  std::vector<uint8_t> rgb;     ///< [height, width, 3]
  std::vector<uint16_t> depth;  ///< [height, width] in the unit that SlamSettings gives; 0: not measured.
};

}  // namespace photoslam
