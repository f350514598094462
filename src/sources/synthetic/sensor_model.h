// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "image/image.h"
#include "sources/synthetic/scene_view.h"
#include "sources/synthetic/synthetic_options.h"

namespace photoslam {

/// 8-bit RGB image of a view: exposure, the camera's tone curve, noise. Every pixel's noise depends only on the noise
/// seed and its place.
ImageU8 expose(const SceneView& view, double exposure_ev, double noise, uint64_t noise_seed);

/// 16-bit depth image with noise and holes; 0 is no measurement, and so is what does not fit into 16 bits.
ImageU16 measure_depth(const SceneView& view, double metres_per_unit, double noise, double holes, uint64_t noise_seed);

}  // namespace photoslam
