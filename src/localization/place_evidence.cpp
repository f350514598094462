// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/place_evidence.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace photoslam {

void PlaceEvidenceOptions::visit(OptionVisitor& v) {
  v.value({"min_matched_share", "", 0.0, 1.0,
           "Share of the landmarks that should be visible and is found again, and two standard deviations more: fewer "
           "landmarks tell less. Lower finds places under changed light, higher resists places that repeat."},
          min_matched_share);
  v.value({"min_coverage", "", 0.0, 1.0,
           "Share of the image, of what should show the old place, in which some of it is found again: a thing that "
           "looks like another one does not look so all around it."},
          min_coverage);
}

PlaceEvidence::PlaceEvidence(int width, int height, const Features& features) : width_(width), height_(height) {
  for (const Keypoint& k : features.keypoints) ++keypoints_[cell(k.x, k.y)];
}

size_t PlaceEvidence::cell(float x, float y) const {
  const auto along = [](float position, int size, int cells) {
    return std::clamp(static_cast<int>(position * static_cast<float>(cells) / static_cast<float>(size)), 0, cells - 1);
  };
  return static_cast<size_t>(along(y, height_, kRows) * kColumns + along(x, width_, kColumns));
}

int PlaceEvidence::found() const { return std::accumulate(found_.begin(), found_.end(), 0); }

int PlaceEvidence::findable() const {
  int sum = 0;
  for (size_t i = 0; i < expected_.size(); ++i) sum += std::min(expected_[i], keypoints_[i]);
  return sum;
}

double PlaceEvidence::coverage() const {
  constexpr int kMinExpected = 3;
  constexpr double kMinFoundShare = 0.2;
  int cells = 0, covered = 0;
  for (size_t i = 0; i < expected_.size(); ++i) {
    if (expected_[i] < kMinExpected) continue;
    ++cells;
    covered += found_[i] >= kMinFoundShare * expected_[i];
  }
  return cells > 0 ? static_cast<double>(covered) / cells : 0;
}

bool PlaceEvidence::suffices(const PlaceEvidenceOptions& options) const {
  constexpr double kDeviations = 2;
  const double share = options.min_matched_share, mean = share * findable();
  return found() > mean + kDeviations * std::sqrt((1 - share) * mean) && coverage() >= options.min_coverage;
}

}  // namespace photoslam
