// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Scenes for the engine's tests, as the engine and as the oracle see them.

#include <string>
#include <vector>

#include "base/random.h"
#include "splatting/model.h"
#include "splatting/testing/reference_rasterizer.h"
#include "splatting/view.h"

namespace photoslam::splatting::testing {

struct Scene {
  std::string name;
  int width = 97, height = 61;
  int count = 250;
  int anchors = 1;
  int sh_degree = 3;
  int shrink_factor = 1;
  double depth_min = 0.6, depth_max = 5;
  double spread = 1.1;  ///< Directions reach this far beyond the image border (1 = border).
  double log_scale_min = -4.5, log_scale_max = -1.2;
  double needle = 0;  ///< Added to one axis' log-scale, subtracted from another's.
  double logit_min = -2, logit_max = 4;
  double distance = 0;  ///< Of camera and gaussians from the anchors' origins [m].
  double image_tolerance = 5e-6, gradient_tolerance = 1e-4;
  double noise = 1e-5;  ///< For the oracle's ambiguous pixels.
  double max_ambiguous = 0.02;

  // Filled by build().
  GaussianModel model;
  std::vector<Pose> poses;
  View view;
  RenderOptions options;
  std::vector<reference::Gaussian> reference_gaussians;  // in the order of `indices`
  std::vector<size_t> indices;
  reference::View reference_view;

  void build(uint64_t seed);
  size_t plane() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

/// The scenes every backend has to get right.
std::vector<Scene> hard_scenes();

/// A random rotation matrix, row-major.
void random_rotation(Random& random, double angle, double* rotation);

}  // namespace photoslam::splatting::testing
