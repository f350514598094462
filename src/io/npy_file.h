// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "image/image.h"

namespace photoslam {

/// Writes an image as a NumPy array of float32 [height, width, channels] (format 1.0, little endian), atomically.
Status write_npy(const std::filesystem::path& path, const ImageF& image);

}  // namespace photoslam
