// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "io/gaussian_ply.h"

namespace photoslam {

/// Writes the compressed file that viewers on the web and phones read (Niantic's SPZ, version 3), atomically: about a
/// tenth of the PLY. Positions are kept to 1/4096 of a unit within ±2048 units, angles to about 0.1°, the rest to 8
/// bits and fewer; spherical harmonics up to the highest degree in use. Axes are converted to those of the format (x
/// right, y up, z backwards). Rows with a value that is not finite, or out of range, are left out and counted.
Result<GaussianPlyReport> write_gaussian_spz(const std::filesystem::path& path, const GaussianTable& gaussians);

/// Writes the simplest file of web viewers (.splat): 32 bytes each, colours without dependence on the view, those of
/// largest opacity times size first. Rows with a value that is not finite are left out and counted.
Result<GaussianPlyReport> write_gaussian_splat(const std::filesystem::path& path, const GaussianTable& gaussians);

}  // namespace photoslam
