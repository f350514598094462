// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "features/orb.h"

namespace photoslam {

/// Buckets the keypoints of one image in square cells, so that those near a pixel are found without looking at all.
class KeypointGrid {
 public:
  /// Keypoints outside the image land in the cells of its border. Reuses its memory.
  void build(std::span<const Keypoint> keypoints, int width, int height);

  /// Calls visit(index) for the keypoints in the cells that touch the square of half side `radius` around (x, y): a
  /// superset of those within `radius`, in a fixed order.
  template <class Visit>
  void for_each_near(float x, float y, float radius, Visit&& visit) const {
    if (columns_ == 0) return;
    const int first_column = cell(x - radius, columns_), last_column = cell(x + radius, columns_);
    const int last_row = cell(y + radius, rows_);
    for (int row = cell(y - radius, rows_); row <= last_row; ++row) {
      // The cells of one row are neighbours in memory.
      const int* begin = indices_.data() + start_[static_cast<size_t>(row * columns_ + first_column)];
      const int* end = indices_.data() + start_[static_cast<size_t>(row * columns_ + last_column + 1)];
      for (; begin != end; ++begin) visit(*begin);
    }
  }

 private:
  static constexpr float kCellSize = 16;  // [px]
  static int cell(float coordinate, int count) {
    // The negated comparison sends NaN to the first cell.
    if (!(coordinate >= 0)) return 0;
    return coordinate >= kCellSize * static_cast<float>(count) ? count - 1 : static_cast<int>(coordinate / kCellSize);
  }

  int columns_ = 0, rows_ = 0;
  std::vector<int> start_;    // [rows * columns + 1] into indices_
  std::vector<int> indices_;  // [N] keypoints, cell by cell, ascending within a cell
};

/// Where a landmark is expected in an image, and what it looks like.
struct ProjectionQuery {
  float x = 0, y = 0;  ///< Predicted pixel.
  float radius = 0;    ///< Search radius [px].
  int min_octave = 0;  ///< Octaves accepted, both ends included.
  int max_octave = 0;
  float angle = std::numeric_limits<float>::quiet_NaN();  ///< Orientation where last seen [rad]; NaN: unknown.
  float u_right =
      std::numeric_limits<float>::quiet_NaN();  ///< Predicted column in the right image; NaN: not predicted.
  Descriptor descriptor{};
};

struct MatchOptions {
  int max_distance = 100;      ///< Bits; a match differs in at most so many.
  double max_ratio = 1.0;      ///< Best distance ≤ ratio * second best of the same octave; 1 accepts every best one.
  bool check_rotation = true;  ///< Drop matches whose change of orientation disagrees with that of the others.
  void visit(OptionVisitor& visitor);
};

/// One side of a match is the position in the queries, the other the keypoint index; −1 where there is none.
inline constexpr int kNoMatch = -1;

/// Finds for each projected landmark the keypoint that looks most like it. A keypoint goes to at most one landmark, the
/// most similar one. Keeps its buffers between calls; deterministic.
class ProjectionMatcher {
 public:
  /// What is known about the image that is searched, index by index with its keypoints.
  struct Target {
    const Features& features;
    const KeypointGrid& grid;
    std::span<const float> u_right;  ///< Measured right column, NaN where unknown; may be empty. Where both it and the
                                     ///< prediction are known they must agree within the search radius.
    std::span<const uint8_t> taken;  ///< Keypoints that are not to be matched any more; may be empty.
  };

  /// Writes keypoint_of_query[i], kNoMatch where query i found nothing; returns the number of matches.
  int match(const MatchOptions& options, const Target& target, std::span<const ProjectionQuery> queries,
            std::vector<int>& keypoint_of_query);

 private:
  std::vector<int> query_of_keypoint_;
  std::vector<int> distance_of_keypoint_;
  std::vector<float> rotations_;
  std::vector<uint8_t> keep_;
};

/// Matches two sets of features without knowing where to look: best by Hamming distance, ratio test, mutual, rotation
/// consistency. Writes b_of_a[i], kNoMatch where there is none; returns the number of matches.
int match_brute_force(const MatchOptions& options, const Features& a, const Features& b, std::vector<int>& b_of_a);

/// Keeps the rotations [rad] that fall into the three most frequent of 30 bins (or fewer, where the others are rare);
/// NaN is always kept. Writes keep[i].
void select_consistent_rotations(std::span<const float> rotations, std::vector<uint8_t>& keep);

}  // namespace photoslam
