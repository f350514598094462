// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "photoslam/types.h"

namespace photoslam {

/// A photorealistic map: 3D gaussians in the world frame. Cheap to copy; never changes.
class SplatMap {
 public:
  /// A map without gaussians.
  SplatMap();
  /// Reads a PLY file in the layout of 3D Gaussian Splatting. Throws Failure.
  static SplatMap load(const std::filesystem::path& file);
  /// Writes such a file, whole or not at all. Throws Failure.
  void save(const std::filesystem::path& file) const;

  size_t num_gaussians() const;

  /// Draws the view of an undistorted camera (its distortion is ignored): RGB, [height, width, 3]. Uses all cores.
  std::vector<uint8_t> render(const CameraModel& camera, const CameraPose& pose) const;

 private:
  friend struct SplatMapAccess;
  struct State;
  std::shared_ptr<const State> state_;
};

}  // namespace photoslam
