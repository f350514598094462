// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/open_source.h"

namespace photoslam::internal {

/// The folder of an EuRoC ASL sequence that holds cam0/: the folder itself or its mav0/; nothing where there is none.
std::optional<std::filesystem::path> find_euroc_folder(const std::filesystem::path& folder);

bool looks_like_euroc(const std::filesystem::path& folder);

/// EuRoC ASL (Burri et al. 2016): mav0/cam0, cam1 with sensor.yaml, data.csv (nanoseconds, file) and data/. Stereo
/// where both cameras are there; images of one trigger are at most 5 ms apart.
Result<std::unique_ptr<FrameSource>> open_euroc(const std::filesystem::path& folder, const SourceOptions& options);

}  // namespace photoslam::internal
