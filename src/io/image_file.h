// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "image/image.h"

namespace photoslam {

/// Reads a PNG or JPEG file (told apart by content, not by name) as 8-bit RGB (3 channels) or grey (1 channel).
/// Truncated and corrupt files are errors that name the file.
Result<ImageU8> read_image(const std::filesystem::path& path);

/// Reads a single-channel 16-bit PNG, as RGB-D data sets use for depth.
Result<ImageU16> read_depth_png(const std::filesystem::path& path);

/// Writes PNG (1 or 3 channels) atomically. `compression` 0…9, as zlib.
Status write_png(const std::filesystem::path& path, const ImageU8& image, int compression = 3);
Status write_png(const std::filesystem::path& path, const ImageU16& image, int compression = 3);

/// The content of a JPEG file (1 or 3 channels). Colour is kept at full resolution. `quality` 1…100.
Result<std::string> encode_jpeg(const ImageU8& image, int quality = 92);

/// Writes it atomically.
Status write_jpeg(const std::filesystem::path& path, const ImageU8& image, int quality = 92);

}  // namespace photoslam
