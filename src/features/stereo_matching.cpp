// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/stereo_matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

#include "base/check.h"

namespace photoslam {
namespace {

// The searched patch: 16 columns, one vector instruction per row, by 11 rows.
constexpr int kLeft = 8, kColumns = 16, kHalfRows = 5;
// The refined one is square.
constexpr int kHalf = 5;
constexpr int kBorder = kLeft + 2;  // also room for interpolation
constexpr int kNeighbourhood = 2;   // columns around the best one that are no rivals
constexpr double kMinDisparity = 0.1;

int patch_difference(const GreyView& a, int ax, const GreyView& b, int bx, int y) {
  int sum = 0;
  for (int row = y - kHalfRows; row <= y + kHalfRows; ++row) {
    const uint8_t* pa = a.at(ax - kLeft, row);
    const uint8_t* pb = b.at(bx - kLeft, row);
    for (int i = 0; i < kColumns; ++i) sum += std::abs(pa[i] - pb[i]);
  }
  return sum;
}

/// Of three pixels above each other.
int16_t smooth_column(uint8_t above, uint8_t middle, uint8_t below) {
  return static_cast<int16_t>(above + 2 * middle + below);
}

/// The left patch and, after each step, the right one at a real column, both without their mean.
class PatchRefinement {
 public:
  PatchRefinement(const GreyView& left, int x, const GreyView& right, int y) : right_(right), y_(y) {
    size_t i = 0;
    for (int v = -kHalf; v <= kHalf; ++v) {
      for (int u = -kHalf; u <= kHalf; ++u) left_[i++] = *left.at(x + u, y + v);
    }
    remove_mean(left_);
  }

  /// Gauss-Newton on the sum of squared differences from the column `start`; nothing when it runs away. The result is
  /// the column and the normalised cross-correlation there.
  std::optional<std::pair<double, double>> run(int start) {
    constexpr int kMaxSteps = 8;
    constexpr double kMaxShift = 1.5, kConverged = 0.01;
    double column = start;
    for (int step = 0; step < kMaxSteps; ++step) {
      sample(column);
      float hessian = 0, gradient = 0;
      for (size_t i = 0; i < kArea; ++i) {
        hessian += slope_[i] * slope_[i];
        gradient += slope_[i] * (patch_[i] - left_[i]);
      }
      if (!(hessian > 0)) return std::nullopt;
      const double change = -static_cast<double>(gradient / hessian);
      column += change;
      if (!(std::abs(column - start) <= kMaxShift)) return std::nullopt;
      if (std::abs(change) < kConverged) break;
    }
    sample(column);
    float cross = 0, left_square = 0, right_square = 0;
    for (size_t i = 0; i < kArea; ++i) {
      cross += left_[i] * patch_[i];
      left_square += left_[i] * left_[i];
      right_square += patch_[i] * patch_[i];
    }
    if (!(left_square > 0 && right_square > 0)) return std::nullopt;
    return std::pair{column, static_cast<double>(cross / std::sqrt(left_square * right_square))};
  }

 private:
  static constexpr size_t kArea = (2 * kHalf + 1) * (2 * kHalf + 1);
  using Patch = std::array<float, kArea>;

  static void remove_mean(Patch& patch) {
    float sum = 0;
    for (const float value : patch) sum += value;
    for (float& value : patch) value -= sum / static_cast<float>(kArea);
  }

  void sample(double column) {
    const double floor = std::floor(column);
    const int x = static_cast<int>(floor);
    const auto weight = static_cast<float>(column - floor);
    size_t i = 0;
    for (int v = -kHalf; v <= kHalf; ++v) {
      const uint8_t* row = right_.at(x - kHalf, y_ + v);
      for (int u = 0; u <= 2 * kHalf; ++u, ++i) {
        const float before = row[u - 1], a = row[u], b = row[u + 1], after = row[u + 2];
        patch_[i] = a + weight * (b - a);
        slope_[i] = 0.5f * ((1 - weight) * (b - before) + weight * (after - a));
      }
    }
    remove_mean(patch_);
    remove_mean(slope_);
  }

  const GreyView& right_;
  int y_;
  Patch left_, patch_, slope_;
};

}  // namespace

void StereoOptions::visit(OptionVisitor& v) {
  v.value({"min_depth_baselines", "", 0.5, 100.0,
           "Nearest depth that is matched, in distances between the cameras; smaller takes longer."},
          min_depth_baselines);
  v.value({"max_depth_baselines", "", 1.0, 10000.0,
           "Depth beyond this, in distances between the cameras, guides tracking but is not adjusted to."},
          max_depth_baselines);
  v.value({"max_ambiguity", "", 0.1, 1.0, "Best patch difference over second best; lower drops repetitive patterns."},
          max_ambiguity);
  v.value({"min_correlation", "", 0.0, 1.0, "Normalised cross-correlation of matching patches."}, min_correlation);
}

void StereoMatcher::DerivativeImage::build(const GreyView& grey) {
  const ptrdiff_t stride = grey.width + kRowPadding;
  pixels.resize(static_cast<size_t>(stride * grey.height));
  view = {pixels.data(), grey.width, grey.height, stride};
  columns_.resize(static_cast<size_t>(grey.width));
  for (int y = 1; y + 1 < grey.height; ++y) {
    const uint8_t *above = grey.row(y - 1), *row = grey.row(y), *below = grey.row(y + 1);
    uint8_t* target = pixels.data() + y * stride;
    // In 16 bits, and in two passes, so that the compiler takes full vectors.
    for (int x = 0; x < grey.width; ++x) columns_[static_cast<size_t>(x)] = smooth_column(above[x], row[x], below[x]);
    const int16_t* const columns = columns_.data();
    for (int x = 1; x + 1 < grey.width; ++x) {
      const auto quarter = static_cast<int16_t>(static_cast<int16_t>(columns[x + 1] - columns[x - 1]) >> 2);
      const int16_t low = quarter < int16_t{-127} ? int16_t{-127} : quarter;
      const int16_t clamped = low > int16_t{127} ? int16_t{127} : low;
      target[x] = static_cast<uint8_t>(clamped + 128);
    }
  }
}

/// The column in [first, last] of the row that looks most like the pattern, if it is unique.
StereoMatcher::Candidate StereoMatcher::search(const GreyView& pattern, int x, int y, const GreyView& image, int first,
                                               int last) {
  first = std::max(first, kBorder);
  last = std::min(last, image.width - 1 - kBorder);
  if (first > last) return {};
  differences_.clear();
  Candidate best{-1, std::numeric_limits<int>::max()};
  for (int column = first; column <= last; ++column) {
    const int difference = patch_difference(pattern, x, image, column, y);
    differences_.push_back(difference);
    if (difference < best.difference) best = {column, difference};
  }
  const double limit = best.difference / options_.max_ambiguity;
  for (int column = first; column <= last; ++column) {
    if (std::abs(column - best.column) > kNeighbourhood && differences_[static_cast<size_t>(column - first)] < limit) {
      return {};
    }
  }
  return best;
}

int StereoMatcher::match(const GreyPyramid& left, std::span<const Keypoint> keypoints, const GreyPyramid& right,
                         double max_disparity, std::vector<float>& disparity) {
  PHOTOSLAM_CHECK(left.num_levels() == right.num_levels(), "{} and {} levels", left.num_levels(), right.num_levels());
  disparity.assign(keypoints.size(), std::numeric_limits<float>::quiet_NaN());
  // Level by level, so that the derivatives of one level are made once.
  order_.resize(keypoints.size());
  for (size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<int>(i);
  std::ranges::stable_sort(order_, {}, [&](int i) { return keypoints[static_cast<size_t>(i)].octave; });
  int level = -1, matches = 0;
  for (const int index : order_) {
    const Keypoint& keypoint = keypoints[static_cast<size_t>(index)];
    if (keypoint.octave != level) {
      level = keypoint.octave;
      left_.build(left.level(level));
      right_.build(right.level(level));
    }
    const double scale = left.scale(level);
    const int x = static_cast<int>(std::lround((static_cast<double>(keypoint.x) + 0.5) / scale - 0.5));
    const int y = static_cast<int>(std::lround((static_cast<double>(keypoint.y) + 0.5) / scale - 0.5));
    const GreyView& image = left_.view;
    if (x < kBorder || y < kBorder || x >= image.width - kBorder || y >= image.height - kBorder) continue;
    const int range = static_cast<int>(std::ceil(max_disparity / scale));
    const Candidate there = search(left_.view, x, y, right_.view, x - range, x + 1);
    if (there.column < 0) continue;
    const Candidate back = search(right_.view, there.column, y, left_.view, there.column - 1, there.column + range);
    if (back.column < 0 || std::abs(back.column - x) > 1) continue;
    const auto refined = PatchRefinement(left.level(level), x, right.level(level), y).run(there.column);
    if (!refined || refined->second < options_.min_correlation) continue;
    const double found = (x - refined->first) * scale;
    if (found < kMinDisparity || found > max_disparity) continue;
    disparity[static_cast<size_t>(index)] = static_cast<float>(found);
    ++matches;
  }
  return matches;
}

}  // namespace photoslam
