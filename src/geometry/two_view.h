// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/options.h"
#include "camera/pinhole.h"
#include "math/se3.h"

namespace photoslam {

/// b = H a, up to scale, of four or more corresponding points on the plane z = 1 (normalised direct linear transform).
Mat3 fit_homography(std::span<const Vec2> a, std::span<const Vec2> b);

/// bᵀ E a = 0 of eight or more corresponding points on the plane z = 1, with the singular values of an essential matrix
/// (normalised eight-point algorithm).
Mat3 fit_essential(std::span<const Vec2> a, std::span<const Vec2> b);

/// The four motions b_from_a (translation of unit length) that explain an essential matrix.
std::vector<SE3> motions_from_essential(const Mat3& essential);

/// The up to four motions b_from_a (translation of unit length) that explain what a plane does between two views (Ma et
/// al. 2004, Sec. 5.3.3); none for a pure rotation.
std::vector<SE3> motions_from_homography(const Mat3& homography);

struct TwoViewOptions {
  int max_iterations = 200;
  double sigma_px = 1.0;          ///< Of a keypoint on the finest pyramid level.
  double min_parallax_deg = 1.0;  ///< Angle between the two rays to a point …
  int min_points = 50;            ///< … that at least so many points have.
  double min_support = 0.5;       ///< Points of a motion that is worth a closer look, over those of the best.
  void visit(OptionVisitor& visitor);
};

/// A motion and the points that it puts in front of both cameras.
struct TwoViewMotion {
  SE3 b_from_a;               ///< Translation of unit length.
  std::vector<Vec3> points;   ///< [N] in the frame of camera a, where reconstructed.
  std::vector<uint8_t> good;  ///< [N] whether it was.
  int num_good = 0;
  double parallax_deg = 0;  ///< That of the min_points-th best point.
};

struct TwoViewResult {
  bool success = false;
  std::string reason;         ///< Why there is no success.
  bool plane_scores = false;  ///< Whether the homography explains the matches better than the essential matrix.
  /// Those worth a closer look (min_support), most points first; some may be estimates of the same motion.
  std::vector<TwoViewMotion> motions;
};

/// Relative pose and structure from two views alone. RANSAC fits a homography and an essential matrix; the motions of
/// both are tried on all matches. Which of them is meant, counting points in front of both cameras cannot always tell:
/// a plane has two motions, and what lies near a plane makes the essential matrix arbitrary. Refused: a pure rotation,
/// too little parallax. Deterministic.
///
/// Pixels of camera a and b correspond; sigmas [px] per correspondence relative to sigma_px.
TwoViewResult reconstruct_two_views(const TwoViewOptions& options, const PinholeCamera& camera,
                                    std::span<const Vec2> pixels_a, std::span<const Vec2> pixels_b,
                                    std::span<const double> sigmas);

}  // namespace photoslam
