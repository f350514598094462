// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "base/result.h"

namespace photoslam {

/// Gaussians as 3D Gaussian Splatting stores them: raw, before any activation. Row-major [N, 59].
struct GaussianTable {
  /// Position x, y, z.
  static constexpr size_t kPosition = 0;
  /// Spherical harmonics of degree 0: red, green, blue.
  static constexpr size_t kShDc = 3;
  /// Higher degrees, channel after channel: 15 of red, 15 of green, 15 of blue.
  static constexpr size_t kShRest = 6;
  /// Logit of the opacity.
  static constexpr size_t kOpacity = 51;
  /// Natural logarithms of the three standard deviations.
  static constexpr size_t kScale = 52;
  /// Quaternion w, x, y, z; any norm but zero.
  static constexpr size_t kRotation = 55;
  static constexpr size_t kColumns = 59;

  std::vector<float> values;

  size_t size() const { return values.size() / kColumns; }
  void resize(size_t count) { values.resize(count * kColumns); }
  std::span<float, kColumns> row(size_t i) { return std::span<float, kColumns>(&values[i * kColumns], kColumns); }
  std::span<const float, kColumns> row(size_t i) const {
    return std::span<const float, kColumns>(&values[i * kColumns], kColumns);
  }
};

struct GaussianPlyReport {
  size_t written = 0;
  size_t left_out = 0;  ///< Rows with a value that is not finite.
};

/// Writes the PLY file that splat viewers read: 62 float properties (the normals are zero), binary little endian,
/// atomically. Rows with a value that is not finite are left out and counted.
Result<GaussianPlyReport> write_gaussian_ply(const std::filesystem::path& path, const GaussianTable& gaussians);

/// Reads such a file with its properties in any order. Missing f_rest_* (all of a degree: 0, 9, 24 or 45 of them) are
/// zero; properties that are not ours are skipped. Values come back bit by bit.
///
/// Errors name the file and say what is missing: no PLY, not binary little endian, no vertices, an absent property,
/// data shorter than the header promises.
Result<GaussianTable> read_gaussian_ply(const std::filesystem::path& path);

}  // namespace photoslam
