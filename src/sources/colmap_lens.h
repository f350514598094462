// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "image/rectification.h"

namespace photoslam {

/// A camera model of COLMAP: one or two focal lengths, the principal point, and coefficients of the lens.
struct ColmapLens {
  int32_t id = 0;  ///< In binary models.
  std::string_view name;
  bool one_focal_length = false;
  LensModel model = LensModel::radial_tangential;
  std::vector<double Distortion::*> coefficients;

  size_t num_parameters() const { return (one_focal_length ? 3 : 4) + coefficients.size(); }
};

/// The models that photoslam has as well.
std::span<const ColmapLens> colmap_lenses();

/// The camera of a model's parameters, [num_parameters()]. Sizes and focal lengths out of range are errors, which do
/// not name the file.
Result<CalibratedCamera> colmap_camera(const ColmapLens& lens, double width, double height,
                                       std::span<const double> parameters);

/// What to say of a model (its name, or number) that is none of these.
Error unknown_colmap_lens(std::string_view model);

}  // namespace photoslam
