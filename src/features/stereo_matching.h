// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/options.h"
#include "features/grey_pyramid.h"
#include "features/orb.h"

namespace photoslam {

struct StereoOptions {
  double min_depth_baselines = 2.0;   ///< Nearest point that is matched, in distances between the cameras.
  double max_depth_baselines = 40.0;  ///< Depth beyond this is no measurement, only a hint.
  double max_ambiguity = 0.9;         ///< Best patch difference, relative to the second best.
  double min_correlation = 0.85;      ///< Normalised cross-correlation of the two patches.
  void visit(OptionVisitor& visitor);
};

/// Finds keypoints of the left image of a rectified pair in the right one: the most similar patch of the same row and
/// pyramid level, if it is unique, also the best one when looked for from right to left, and alike after refinement to
/// sub-pixel accuracy. Differences in brightness do not matter. Keeps its buffers between calls; deterministic.
class StereoMatcher {
 public:
  explicit StereoMatcher(const StereoOptions& options) : options_(options) {}

  /// Writes disparity[i] = u_left − u_right > 0 [px], NaN where there is no match; returns the number of matches. The
  /// pyramids have the same size; no disparity above `max_disparity` is found.
  int match(const GreyPyramid& left, std::span<const Keypoint> keypoints, const GreyPyramid& right,
            double max_disparity, std::vector<float>& disparity);

  const StereoOptions& options() const { return options_; }

 private:
  /// Horizontal derivatives of one pyramid level: what tells columns apart, and free of brightness.
  struct DerivativeImage {
    std::vector<uint8_t> pixels;
    GreyView view;
    void build(const GreyView& grey);

   private:
    std::vector<int16_t> columns_;
  };
  struct Candidate {
    int column = -1;
    int difference = 0;
  };
  Candidate search(const GreyView& pattern, int x, int y, const GreyView& image, int first, int last);

  StereoOptions options_;
  DerivativeImage left_, right_;
  std::vector<int> differences_;
  std::vector<int> order_;
};

}  // namespace photoslam
