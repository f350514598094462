// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "base/options.h"
#include "features/orb.h"

namespace photoslam {

struct PlaceEvidenceOptions {
  double min_matched_share = 0.25;
  double min_coverage = 0.5;
  void visit(OptionVisitor& visitor);
};

/// What an image shows of the landmarks of a place, were the camera where it is believed to be. A thing that looks like
/// another one, a door along a corridor, lets many landmarks be found, but not all around it what the place shows
/// there.
class PlaceEvidence {
 public:
  /// Image size [px]; the features found in the image.
  PlaceEvidence(int width, int height, const Features& features);

  /// A point of the map projects to this pixel.
  void expect(float x, float y) { ++expected_[cell(x, y)]; }
  /// One of those expected was found here.
  void find(float x, float y) { ++found_[cell(x, y)]; }

  int found() const;
  /// Expected points, but in no part of the image more than it has keypoints: noisy measurements make a landmark
  /// anew in every keyframe, and keypoints are shared out among them.
  int findable() const;
  /// Share of the image cells with expected points in which some were found.
  double coverage() const;

  /// Whether more was found than of a place that only looks alike: of that it would be `min_matched_share` of what is
  /// findable, give or take the deviation of a binomial distribution, and not everywhere.
  bool suffices(const PlaceEvidenceOptions& options) const;

 private:
  static constexpr int kColumns = 8, kRows = 6;
  using Counts = std::array<int, kColumns * kRows>;

  size_t cell(float x, float y) const;

  int width_, height_;
  Counts expected_{}, found_{}, keypoints_{};
};

}  // namespace photoslam
