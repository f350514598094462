// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "features/matching.h"
#include "geometry/two_view.h"
#include "map/keyframe.h"
#include "optimization/bundle_adjustment.h"

namespace photoslam {

struct MonoInitializerOptions {
  double search_radius = 0.16;  ///< Of matches between the two views, relative to the width of the image.
  int min_matches = 100;
  double max_gap_s = 3.0;        ///< The first view is given up when it is older than this.
  double min_score_lead = 0.01;  ///< By which the best of two motions must fit better, relative to its score.
  TwoViewOptions two_view;
  void visit(OptionVisitor& visitor);
};

/// Two views that see enough of the same points to start a map without any measured depth. The unit of length is the
/// median depth of the points in the first view.
struct InitialPair {
  struct Point {
    int first_keypoint = -1;
    int second_keypoint = -1;
    Vec3 in_first = Vec3::Zero();
  };
  std::shared_ptr<const FeatureFrame> first;
  SE3 second_from_first;
  std::vector<Point> points;
};

/// Monocular initialisation: keeps a first view until a later one has enough parallax, reconstructs both and refines
/// them together. Synchronous and deterministic.
class MonoInitializer {
 public:
  MonoInitializer(const MonoInitializerOptions& options, const PinholeCamera& camera)
      : options_(options), camera_(camera) {}

  /// The pair of the first view and this frame; nothing while there is no such pair, for which `reason` says why.
  std::optional<InitialPair> add(const std::shared_ptr<const FeatureFrame>& frame, std::string& reason);

  /// The frame that is the first view at present; invalid when there is none.
  FrameId first_view() const { return first_ ? first_->frame : FrameId{}; }
  void restart() { first_.reset(); }

 private:
  int match(const FeatureFrame& frame);
  struct Refined {
    InitialPair pair;
    double score = 0;  ///< How far the squared errors stay below their limit, summed over both views.
  };
  Refined refined(const FeatureFrame& frame, const TwoViewMotion& motion);

  MonoInitializerOptions options_;
  PinholeCamera camera_;
  ProjectionMatcher matcher_;
  BundleAdjuster adjuster_;
  std::shared_ptr<const FeatureFrame> first_;
  std::vector<Vec2> expected_;  // [N of the first view] where each keypoint was last seen
  std::vector<int> keypoint_of_first_;
  std::vector<std::pair<int, int>> matches_;  // keypoints of both views
};

}  // namespace photoslam
