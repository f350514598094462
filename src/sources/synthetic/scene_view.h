// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

namespace photoslam {

/// What an ideal camera sees; images of the camera's size.
struct SceneView {
  ImageF radiance;   ///< [H, W, 3], linear, 1 = white at normal exposure; averaged over pixel area and exposure time.
  ImageF depth;      ///< z coordinate [m] of the surface at the pixel centre; 0 where there is none, as in the sky.
  ImageF incidence;  ///< Cosine of the angle between the ray through the pixel centre and the surface normal.
};

/// Draft: the same scene with coarser textures and light, made in a tenth of the time; for tests of other things.
enum class SceneQuality { full, draft };

}  // namespace photoslam
