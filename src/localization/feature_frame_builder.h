// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/options.h"
#include "camera/pinhole.h"
#include "features/orb.h"
#include "features/stereo_matching.h"
#include "map/keyframe.h"

namespace photoslam {

struct DepthOptions {
  double virtual_baseline_m = 0.2;  ///< Turns depth into a disparity, whose error does not grow with depth.
  double min_m = 0.1;
  double max_m = 8.0;
  double max_edge_ratio = 0.04;  ///< Depth step in a 3x3 patch, relative to the depth, that marks an edge.
  void visit(OptionVisitor& visitor);
};

/// How a sensor measures depth: by depth images, by a second camera, or not at all.
struct DepthSensor {
  double metres_per_unit = 0;  ///< Of depth images; 0: there are none.
  double baseline_m = 0;       ///< Of a rectified stereo pair; 0: there is no second camera.
};

/// Turns the rectified images of a moment into features with observations. Keeps its buffers between calls.
class FeatureFrameBuilder {
 public:
  /// `mask` is 0 where images have no data after undistortion; empty: they have everywhere.
  FeatureFrameBuilder(const OrbOptions& orb, const DepthOptions& depth, const StereoOptions& stereo,
                      const PinholeCamera& camera, const DepthSensor& sensor, ImageU8 mask = {});

  /// fx * baseline [px m], real for stereo, virtual with depth images; 0 when nothing measures depth.
  double bf() const { return bf_; }

  /// `depth` and `right` may be empty; else they have the size of `grey`. Keypoints on depth edges and holes, or
  /// without a match in the right image, get no depth. What lies beside pixels without data is no feature: the end of
  /// the data moves with the camera.
  std::shared_ptr<const FeatureFrame> build(FrameId id, int64_t timestamp_ns, const ImageU8& grey,
                                            const ImageU16& depth, const ImageU8& right = {});

 private:
  bool is_beside_no_data(const Keypoint& keypoint) const;
  void discard_beside_no_data(Features& features) const;
  double depth_noise(const ImageU16& depth);
  float depth_at(const ImageU16& depth, double noise, const Keypoint& keypoint) const;
  void add_measured_depth(const ImageU16& depth, FeatureFrame& frame);
  void add_stereo_depth(const ImageU8& right, FeatureFrame& frame);

  OrbOptions orb_options_;
  DepthOptions depth_options_;
  DepthSensor sensor_;
  double bf_;
  ImageU8 mask_;
  OrbExtractor extractor_;
  GreyPyramid right_pyramid_;
  StereoMatcher stereo_matcher_;
  std::vector<float> disparity_;
  std::vector<double> second_differences_;
};

}  // namespace photoslam
