// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/options.h"
#include "camera/pinhole.h"
#include "math/sim3.h"

namespace photoslam {

/// One point of the world as two keyframes know it.
struct PointMatch {
  Vec3 point_in_a = Vec3::Zero(), point_in_b = Vec3::Zero();  ///< In the camera frames.
  Vec2 pixel_in_a = Vec2::Zero(), pixel_in_b = Vec2::Zero();  ///< Where each camera saw it.
  double sigma_a = 1.0, sigma_b = 1.0;                        ///< [px]
};

struct SimilarityRansacOptions {
  int max_iterations = 300;
  int min_inliers = 20;
  double max_chi2 = 9.21;  ///< Squared reprojection error over σ², in either image.
  double confidence = 0.999;
  int seed = 1;
  void visit(OptionVisitor& visitor);
};

struct SimilarityResult {
  bool success = false;
  Sim3 b_from_a;
  std::vector<uint8_t> inlier;  ///< One per match.
  int num_inliers = 0;
};

/// The transform between two cameras from matches of which many may be wrong: three matches at a time, aligned in
/// closed form (Umeyama), refined over the inliers. A match agrees when both its points reproject in the other image.
/// Without scale the transform is rigid (depth was measured). Deterministic for a given seed.
SimilarityResult estimate_similarity_ransac(const SimilarityRansacOptions& options, const PinholeCamera& camera,
                                            bool with_scale, std::span<const PointMatch> matches);

/// Only the refinement, from a transform that is nearly right: Gauss-Newton on the reprojection errors in both images,
/// the inliers chosen anew in each of a few rounds.
SimilarityResult refine_similarity(const SimilarityRansacOptions& options, const PinholeCamera& camera, bool with_scale,
                                   std::span<const PointMatch> matches, const Sim3& initial_b_from_a);

}  // namespace photoslam
