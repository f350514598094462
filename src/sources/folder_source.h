// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/open_source.h"

namespace photoslam::internal {

/// "2.jpg" before "10.jpg": digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b);

/// Whether the folder itself has images.
bool looks_like_images(const std::filesystem::path& folder);

/// The images of a folder in natural order of their names, SourceOptions::frames_per_second apart; mono. The
/// calibration is --camera, the folder's camera.yaml, or a guess from --fov.
Result<std::unique_ptr<FrameSource>> open_images(const std::filesystem::path& folder, const SourceOptions& options);

}  // namespace photoslam::internal
