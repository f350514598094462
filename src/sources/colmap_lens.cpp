// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/colmap_lens.h"

#include <string>

#include "base/check.h"
#include "sources/posed_cameras.h"

namespace photoslam {

std::span<const ColmapLens> colmap_lenses() {
  using D = Distortion;
  constexpr LensModel kRadial = LensModel::radial_tangential, kFisheye = LensModel::kannala_brandt;
  static const std::vector<ColmapLens> kLenses = {
      {0, "SIMPLE_PINHOLE", true, kRadial, {}},
      {1, "PINHOLE", false, kRadial, {}},
      {2, "SIMPLE_RADIAL", true, kRadial, {&D::k1}},
      {3, "RADIAL", true, kRadial, {&D::k1, &D::k2}},
      {4, "OPENCV", false, kRadial, {&D::k1, &D::k2, &D::p1, &D::p2}},
      {5, "OPENCV_FISHEYE", false, kFisheye, {&D::k1, &D::k2, &D::k3, &D::k4}},
      {6, "FULL_OPENCV", false, kRadial, {&D::k1, &D::k2, &D::p1, &D::p2, &D::k3, &D::k4, &D::k5, &D::k6}},
      {8, "SIMPLE_RADIAL_FISHEYE", true, kFisheye, {&D::k1}},
      {9, "RADIAL_FISHEYE", true, kFisheye, {&D::k1, &D::k2}}};
  return kLenses;
}

Result<CalibratedCamera> colmap_camera(const ColmapLens& lens, double width, double height,
                                       std::span<const double> parameters) {
  PHOTOSLAM_CHECK(parameters.size() == lens.num_parameters(), "{} parameters of {}", parameters.size(), lens.name);
  const size_t center = lens.one_focal_length ? 1 : 2;
  CalibratedCamera result;
  result.distortion.model = lens.model;
  for (size_t i = 0; i < lens.coefficients.size(); ++i)
    result.distortion.*lens.coefficients[i] = parameters[center + 2 + i];
  const auto camera = checked_camera(width, height, parameters[0], parameters[center - 1], parameters[center] - 0.5,
                                     parameters[center + 1] - 0.5);
  if (!camera) return camera.error();
  result.camera = *camera;
  return result;
}

Error unknown_colmap_lens(std::string_view model) {
  std::string known;
  for (const ColmapLens& lens : colmap_lenses()) known += fmt::format("{}{}", known.empty() ? "" : ", ", lens.name);
  return error("camera model {}; undistort the images first (colmap image_undistorter), or calibrate one of {}", model,
               known);
}

}  // namespace photoslam
