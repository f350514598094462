// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/doubled_gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "math/median.h"

namespace photoslam {
namespace {

constexpr double kSh0 = 0.28209479177387814;  // Y_0

/// A gaussian as the search sees it.
struct Candidate {
  size_t index = 0;
  size_t anchor = 0;
  Vec3 in_anchor;  // unit of the anchor's birth
  Vec3 in_world;   // after the correction
  Vec3 color;
  double size = 0;  // standard deviation along the disc [world]
};

Candidate make_candidate(const splatting::GaussianModel& model, size_t index, std::span<const Sim3> after) {
  const splatting::Gaussian g = model.get(index);
  Candidate c;
  c.index = index;
  c.anchor = static_cast<size_t>(model.anchor(index));
  const Sim3 world_from_anchor = after[c.anchor].inverse();
  // Stored in the present unit of the anchor, which is the world's.
  const double birth_from_present = 1 / world_from_anchor.scale;
  std::array<double, 3> sigma{};
  for (int i = 0; i < 3; ++i) {
    c.in_anchor[i] = birth_from_present * static_cast<double>(g.mean[i]);
    c.color[i] = kSh0 * static_cast<double>(g.sh[0][i]);
    sigma[static_cast<size_t>(i)] = std::exp(static_cast<double>(g.log_scale[i]));
  }
  std::ranges::sort(sigma);
  c.in_world = world_from_anchor * c.in_anchor;
  c.size = std::sqrt(sigma[1] * sigma[2]);
  return c;
}

/// Candidates by the cube of space they lie in.
class Grid {
 public:
  explicit Grid(double cell) : cell_(cell) {}

  void add(const Candidate& candidate) { cells_[key(cube(candidate.in_world))].push_back(&candidate); }

  /// Calls visit(candidate) for those around a point, until it returns true.
  template <class Visit>
  void around(const Vec3& point, Visit&& visit) const {
    const auto center = cube(point);
    for (int64_t i = 0; i < 27; ++i) {
      const auto found = cells_.find(key({center[0] + i % 3 - 1, center[1] + i / 3 % 3 - 1, center[2] + i / 9 - 1}));
      if (found == cells_.end()) continue;
      for (const Candidate* candidate : found->second) {
        if (visit(*candidate)) return;
      }
    }
  }

 private:
  std::array<int64_t, 3> cube(const Vec3& p) const {
    const auto part = [&](double x) { return static_cast<int64_t>(std::floor(x / cell_)); };
    return {part(p.x()), part(p.y()), part(p.z())};
  }
  /// Cubes may share a key: whoever visits looks at the distance.
  static uint64_t key(const std::array<int64_t, 3>& c) {
    constexpr std::array<uint64_t, 3> kPrimes{73856093, 19349663, 83492791};
    uint64_t result = 0;
    for (size_t i = 0; i < 3; ++i) result ^= static_cast<uint64_t>(c[i]) * kPrimes[i];
    return result;
  }

  double cell_;
  std::unordered_map<uint64_t, std::vector<const Candidate*>> cells_;
};

}  // namespace

void DoublingOptions::visit(OptionVisitor& v) {
  v.value({"enabled", "", 0, 0, "Merge gaussians that a correction of the map has brought together."}, enabled);
  v.value(
      {"max_distance", "", 0.0, 10.0, "Between the centres of two that are the same, in their standard deviations."},
      max_distance);
  v.value({"max_size_ratio", "", 1.0, 100.0, "Between their sizes."}, max_size_ratio);
  v.value({"max_color_difference", "", 0.0, 3.0, "Between their colours, the norm over the channels."},
          max_color_difference);
}

size_t merge_doubled(const DoublingOptions& options, std::span<const Sim3> before, std::span<const Sim3> after,
                     std::span<const int> seams, splatting::GaussianModel& model) {
  if (!options.enabled || seams.empty()) return 0;
  std::vector<uint8_t> at_seam(after.size(), 0);
  for (const int anchor : seams) at_seam[static_cast<size_t>(anchor)] = 1;
  std::vector<Candidate> candidates;
  std::vector<double> sizes;
  model.for_each([&](size_t i) {
    if (at_seam[static_cast<size_t>(model.anchor(i))] == 0) return;
    const Candidate candidate = make_candidate(model, i, after);
    constexpr double kFarthest = 1e6;  // in units of its size; beyond there is only garbage
    if (!(candidate.size > 0) || !(candidate.in_world.norm() < kFarthest * candidate.size)) return;
    candidates.push_back(candidate);
    sizes.push_back(candidate.size);
  });
  if (candidates.empty()) return 0;
  std::ranges::stable_sort(candidates, {}, &Candidate::anchor);

  const auto is_double = [&](const Candidate& old, const Candidate& young) {
    const double reach = options.max_distance * std::min(old.size, young.size);
    const double ratio = std::max(old.size, young.size) / std::min(old.size, young.size);
    if (old.anchor == young.anchor || (old.in_world - young.in_world).norm() > reach) return false;
    if (ratio > options.max_size_ratio || (old.color - young.color).norm() > options.max_color_difference) return false;
    const Vec3 was = before[old.anchor] * (before[young.anchor].inverse() * young.in_anchor);
    return (was - old.in_anchor).norm() / after[old.anchor].scale > 2 * reach;
  };
  // Larger ones reach farther than the neighbouring cells: they are few, and only found nearer.
  Grid grid(2 * options.max_distance * lower_median(sizes));
  std::vector<uint8_t> remove(model.index_end(), 0);
  for (const Candidate& young : candidates) {
    const Candidate* same = nullptr;
    grid.around(young.in_world, [&](const Candidate& old) {
      if (is_double(old, young)) same = &old;
      return same != nullptr;
    });
    if (same == nullptr) {
      grid.add(young);
      continue;
    }
    remove[young.index] = 1;
    splatting::Gaussian kept = model.get(same->index);
    kept.opacity_logit = std::max(kept.opacity_logit, model.get(young.index).opacity_logit);
    model.set(same->index, kept);
  }
  return model.remove(remove);
}

}  // namespace photoslam
