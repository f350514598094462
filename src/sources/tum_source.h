// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/open_source.h"

namespace photoslam::internal {

/// Whether the folder has the lists of the TUM RGB-D layout.
bool looks_like_tum(const std::filesystem::path& folder);

/// TUM RGB-D (Sturm et al. 2012): associations.txt, or rgb.txt and depth.txt matched by nearest time within 20 ms. The
/// time of a frame is that of its colour image.
Result<std::unique_ptr<FrameSource>> open_tum(const std::filesystem::path& folder, const SourceOptions& options);

}  // namespace photoslam::internal
