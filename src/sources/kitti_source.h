// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sources/open_source.h"

namespace photoslam::internal {

/// A sequence of the KITTI odometry benchmark on disk.
struct KittiSequence {
  std::filesystem::path folder;  ///< …/sequences/NN
  std::filesystem::path poses;   ///< …/poses/NN.txt, which may not exist.
  int left_camera = 0;           ///< 2 (colour) where image_2 is there, else 0 (grey).
};

/// The sequence in `folder`, or the only one below it (sequences/NN or NN); the error lists them where there are more.
Result<KittiSequence> find_kitti_sequence(const std::filesystem::path& folder);

/// Translation camera_from_cam0 of a rectified KITTI camera, from calib.txt.
Result<SE3> read_kitti_camera_from_cam0(const KittiSequence& sequence);

bool looks_like_kitti(const std::filesystem::path& folder);

/// KITTI odometry (Geiger et al. 2012): calib.txt (P0 to P3), times.txt, image_0 and image_1 (grey) or image_2 and
/// image_3 (colour, preferred), rectified.
Result<std::unique_ptr<FrameSource>> open_kitti(const std::filesystem::path& folder, const SourceOptions& options);

}  // namespace photoslam::internal
