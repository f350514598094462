// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/matching.h"

#include <algorithm>
#include <array>
#include <numbers>

namespace photoslam {
namespace {

/// The two nearest descriptors seen so far.
struct Nearest {
  int index = kNoMatch;
  int distance = 257;
  int octave = -1;
  int second_distance = 257;
  int second_octave = -1;

  void add(int candidate, int candidate_distance, int candidate_octave) {
    if (candidate_distance < distance) {
      second_distance = distance;
      second_octave = octave;
      index = candidate;
      distance = candidate_distance;
      octave = candidate_octave;
    } else if (candidate_distance < second_distance) {
      second_distance = candidate_distance;
      second_octave = candidate_octave;
    }
  }

  /// The same corner is often found in two octaves, so that only a rival in the same octave makes a match ambiguous.
  bool accepted(const MatchOptions& options) const {
    return index != kNoMatch && distance <= options.max_distance &&
           (octave != second_octave || distance <= options.max_ratio * second_distance);
  }
};

int count_matches(const std::vector<int>& matches) {
  return static_cast<int>(std::count_if(matches.begin(), matches.end(), [](int m) { return m != kNoMatch; }));
}

constexpr float kNoRotation = std::numeric_limits<float>::quiet_NaN();

}  // namespace

void MatchOptions::visit(OptionVisitor& visitor) {
  visitor.value({"max_distance", "bits", 0, 256, "Descriptors of a match differ in at most so many of 256 bits."},
                max_distance);
  visitor.value({"max_ratio", "", 0.1, 1, "Best distance over second best; lower drops more ambiguous matches."},
                max_ratio);
  visitor.value({"check_rotation", "", 0, 1, "Drop matches that turned differently from the others."}, check_rotation);
}

void KeypointGrid::build(std::span<const Keypoint> keypoints, int width, int height) {
  columns_ = std::max(1, static_cast<int>(std::ceil(static_cast<float>(width) / kCellSize)));
  rows_ = std::max(1, static_cast<int>(std::ceil(static_cast<float>(height) / kCellSize)));
  // Counting sort by cell.
  start_.assign(static_cast<size_t>(columns_ * rows_ + 1), 0);
  indices_.resize(keypoints.size());
  const auto cell_of = [&](const Keypoint& k) {
    return static_cast<size_t>(cell(k.y, rows_) * columns_ + cell(k.x, columns_));
  };
  for (const Keypoint& keypoint : keypoints) ++start_[cell_of(keypoint)];
  int sum = 0;
  for (int& entry : start_) entry = sum += entry;
  for (size_t i = keypoints.size(); i-- > 0;)
    indices_[static_cast<size_t>(--start_[cell_of(keypoints[i])])] = static_cast<int>(i);
}

int ProjectionMatcher::match(const MatchOptions& options, const Target& target,
                             std::span<const ProjectionQuery> queries, std::vector<int>& keypoint_of_query) {
  const std::vector<Keypoint>& keypoints = target.features.keypoints;
  keypoint_of_query.assign(queries.size(), kNoMatch);
  query_of_keypoint_.assign(keypoints.size(), kNoMatch);
  distance_of_keypoint_.assign(keypoints.size(), 257);
  for (size_t q = 0; q < queries.size(); ++q) {
    const ProjectionQuery& query = queries[q];
    Nearest nearest;
    target.grid.for_each_near(query.x, query.y, query.radius, [&](int index) {
      const auto i = static_cast<size_t>(index);
      const Keypoint& k = keypoints[i];
      if (k.octave < query.min_octave || k.octave > query.max_octave) return;
      const float dx = k.x - query.x, dy = k.y - query.y;
      if (!(dx * dx + dy * dy <= query.radius * query.radius)) return;
      if (!target.taken.empty() && target.taken[i]) return;
      // A comparison with NaN is false: an unknown right column excludes nothing.
      if (!target.u_right.empty() && std::abs(target.u_right[i] - query.u_right) > query.radius) return;
      nearest.add(index, hamming_distance(query.descriptor, target.features.descriptors[i]), k.octave);
    });
    if (!nearest.accepted(options)) continue;
    const auto best = static_cast<size_t>(nearest.index);
    if (nearest.distance >= distance_of_keypoint_[best]) continue;
    if (query_of_keypoint_[best] != kNoMatch)
      keypoint_of_query[static_cast<size_t>(query_of_keypoint_[best])] = kNoMatch;
    query_of_keypoint_[best] = static_cast<int>(q);
    distance_of_keypoint_[best] = nearest.distance;
    keypoint_of_query[q] = nearest.index;
  }

  if (options.check_rotation) {
    rotations_.assign(queries.size(), kNoRotation);
    for (size_t q = 0; q < queries.size(); ++q) {
      if (keypoint_of_query[q] == kNoMatch) continue;
      rotations_[q] = keypoints[static_cast<size_t>(keypoint_of_query[q])].angle - queries[q].angle;
    }
    select_consistent_rotations(rotations_, keep_);
    for (size_t q = 0; q < queries.size(); ++q) {
      if (!keep_[q]) keypoint_of_query[q] = kNoMatch;
    }
  }
  return count_matches(keypoint_of_query);
}

int match_brute_force(const MatchOptions& options, const Features& a, const Features& b, std::vector<int>& b_of_a) {
  b_of_a.assign(a.size(), kNoMatch);
  std::vector<Nearest> nearest_in_a(b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    Nearest nearest_in_b;
    for (size_t j = 0; j < b.size(); ++j) {
      const int distance = hamming_distance(a.descriptors[i], b.descriptors[j]);
      nearest_in_b.add(static_cast<int>(j), distance, b.keypoints[j].octave);
      nearest_in_a[j].add(static_cast<int>(i), distance, a.keypoints[i].octave);
    }
    if (nearest_in_b.accepted(options)) b_of_a[i] = nearest_in_b.index;
  }
  std::vector<float> rotations(a.size(), kNoRotation);
  for (size_t i = 0; i < a.size(); ++i) {
    if (b_of_a[i] == kNoMatch) continue;
    const auto j = static_cast<size_t>(b_of_a[i]);
    if (nearest_in_a[j].index != static_cast<int>(i)) {
      b_of_a[i] = kNoMatch;
    } else {
      rotations[i] = b.keypoints[j].angle - a.keypoints[i].angle;
    }
  }
  if (options.check_rotation) {
    std::vector<uint8_t> keep;
    select_consistent_rotations(rotations, keep);
    for (size_t i = 0; i < a.size(); ++i) {
      if (!keep[i]) b_of_a[i] = kNoMatch;
    }
  }
  return count_matches(b_of_a);
}

void select_consistent_rotations(std::span<const float> rotations, std::vector<uint8_t>& keep) {
  constexpr size_t kBins = 30, kKept = 3;
  // A bin this much rarer than the most frequent one holds chance matches.
  constexpr double kRare = 0.1;
  constexpr float kTurn = static_cast<float>(2 * std::numbers::pi);
  const auto bin_of = [](float rotation) {
    const float turns = rotation / kTurn;
    return static_cast<size_t>(std::lround((turns - std::floor(turns)) * kBins)) % kBins;
  };
  std::array<int, kBins> count{};
  for (float rotation : rotations) {
    if (std::isfinite(rotation)) ++count[bin_of(rotation)];
  }
  std::array<size_t, kBins> order;
  for (size_t i = 0; i < kBins; ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&count](size_t a, size_t b) { return count[a] > count[b]; });
  std::array<bool, kBins> frequent{};
  for (size_t i = 0; i < kKept; ++i) frequent[order[i]] = count[order[i]] >= kRare * count[order[0]];
  keep.resize(rotations.size());
  for (size_t i = 0; i < rotations.size(); ++i) {
    keep[i] = !std::isfinite(rotations[i]) || frequent[bin_of(rotations[i])];
  }
}

}  // namespace photoslam
