// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/options.h"
#include "map/snapshot.h"
#include "photorealistic_mapping/depth_picture.h"

namespace photoslam {

struct FeatureDepthOptions {
  int neighbours = 4;
  double max_distance_px = 48;
  double max_spread = 1.3;
  void visit(OptionVisitor& visitor);
};

/// A pixel of the full image with a depth [m]; 0 = unknown.
struct DepthPixel {
  float x = 0, y = 0;
  float depth = 0;
  bool active = false;  ///< Geometry mapping tracks a landmark there.
};

/// Gives pixels without depth the mean inverse depth of their nearest neighbours that have one, weighted by distance
/// (paper, Sec. 3.3.1, with several neighbours instead of one). Pixels with too few neighbours, or with neighbours on
/// different surfaces (nearest and farthest differ by more than `max_spread`), stay without.
void interpolate_depth(const FeatureDepthOptions& options, std::span<DepthPixel> pixels);

/// The features of a keyframe with a depth each: of the landmark where it is active; else measured by the sensor, read
/// from `picture` (the keyframe's, shrunk by `factor`), or interpolated.
std::vector<DepthPixel> feature_depths(const FeatureDepthOptions& options, const MapSnapshot& map,
                                       const Keyframe& keyframe, const DepthPicture& picture, int factor);

}  // namespace photoslam
