// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/posed_cameras.h"

namespace photoslam {

// COLMAP models in binary form: counts, then records, all little-endian and without padding. Errors name the file and
// the byte where it stops making sense.

/// Reads cameras.bin and images.bin of a folder; images are looked for in `images`. In the order of the file.
Result<std::vector<PosedCamera>> read_colmap_binary_cameras(const std::filesystem::path& folder,
                                                            const std::filesystem::path& images);

/// Reads its points3D.bin.
Result<std::vector<SparsePoint>> read_colmap_binary_points(const std::filesystem::path& folder);

}  // namespace photoslam
