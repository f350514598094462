// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/options.h"
#include "camera/pinhole.h"
#include "features/orb.h"
#include "map/keyframe.h"

namespace photoslam {

struct DepthOptions {
  double virtual_baseline_m = 0.2;  ///< Turns depth into a disparity, whose error does not grow with depth.
  double min_m = 0.1;
  double max_m = 8.0;
  double max_edge_ratio = 0.04;  ///< Depth step in a 3x3 patch, relative to the depth, that marks an edge.
  void visit(OptionVisitor& visitor);
};

/// Turns an undistorted image (with depth) into features with observations. Keeps its buffers between calls.
class FeatureFrameBuilder {
 public:
  FeatureFrameBuilder(const OrbOptions& orb, const DepthOptions& depth, const PinholeCamera& camera,
                      double metres_per_depth_unit);

  /// fx * virtual baseline [px m].
  double bf() const { return camera_.fx * depth_options_.virtual_baseline_m; }

  /// `depth` may be empty; else it has the size of `grey`. Keypoints on depth edges and holes get no depth.
  std::shared_ptr<const FeatureFrame> build(FrameId id, int64_t timestamp_ns, const ImageU8& grey,
                                            const ImageU16& depth);

 private:
  float depth_at(const ImageU16& depth, const Keypoint& keypoint) const;

  OrbOptions orb_options_;
  DepthOptions depth_options_;
  PinholeCamera camera_;
  double metres_per_depth_unit_;
  OrbExtractor extractor_;
};

}  // namespace photoslam
