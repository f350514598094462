// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "camera/pinhole.h"
#include "io/gaussian_ply.h"
#include "io/trajectory_file.h"

namespace photoslam {

/// What a session shows: of maps that hang together with nothing (see connected_components) the one of most keyframes.
struct SessionView {
  PinholeCamera camera;  ///< Undistorted, and of a stereo pair the rectified left one.
  GaussianTable map;
  Trajectory keyframes;  ///< In the order in which they were made.
};

/// Reads session.photoslam, or the one of a folder, to look at: that of a run that was killed, too.
Result<SessionView> view_session(const std::filesystem::path& path);

}  // namespace photoslam
