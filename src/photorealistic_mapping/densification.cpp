// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/densification.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "math/se3.h"

namespace photoslam {
namespace {

using splatting::Gaussian;

constexpr float kMinViews = 3;  // that must have judged a gaussian

bool is_idle(const DensificationOptions& options, const splatting::Statistics& statistics) {
  return statistics.visible >= kMinViews && static_cast<double>(statistics.max_weight) < options.min_weight;
}

double largest_scale(const Gaussian& g) {
  return std::exp(static_cast<double>(std::max({g.log_scale[0], g.log_scale[1], g.log_scale[2]})));
}

/// One of the two halves of a gaussian: drawn from it, 1.6 times smaller, as in 3D Gaussian splatting.
Gaussian half_of(const Gaussian& parent, Random& random) {
  constexpr double kShrink = 1.6;
  Gaussian child = parent;
  const Quat rotation = Quat(static_cast<double>(parent.rotation[0]), static_cast<double>(parent.rotation[1]),
                             static_cast<double>(parent.rotation[2]), static_cast<double>(parent.rotation[3]))
                            .normalized();
  Vec3 offset;
  for (int i = 0; i < 3; ++i) {
    offset[i] = random.normal() * std::exp(static_cast<double>(parent.log_scale[i]));
    child.log_scale[i] = parent.log_scale[i] - static_cast<float>(std::log(kShrink));
  }
  offset = rotation * offset;
  for (int i = 0; i < 3; ++i) child.mean[i] += static_cast<float>(offset[i]);
  return child;
}

}  // namespace

void DensificationOptions::visit(OptionVisitor& v) {
  v.value({"enabled", "", 0, 0, "Split and clone by gradient during refinement."}, enabled);
  v.value({"interval", "iterations", 10, 100000, "Between two rounds."}, interval);
  v.value({"gradient_threshold", "", 0.0, 1.0, "Mean screen-space gradient above which a gaussian is densified."},
          gradient_threshold);
  v.value(
      {"split_size", "", 1e-5, 10.0, "Gaussians larger than this share of the scene depth are split, others cloned."},
      split_size);
  v.value({"min_opacity", "", 0.0, 0.9, "More transparent gaussians are removed."}, min_opacity);
  v.value({"max_scale", "", 0.001, 100.0, "Gaussians larger than this share of the scene depth are removed."},
          max_scale);
  v.value({"min_weight", "", 0.0, 1.0, "Gaussians that never weigh more in any pixel of a round are removed."},
          min_weight);
  v.value({"max_gaussians", "", 100, 20000000, "Nothing is added beyond this number."}, max_gaussians);
  v.value({"relocation", "", 0, 0, "Beyond it, the least visible gaussians make room for new ones."}, relocation);
}

DensificationCounts densify(const DensificationOptions& options, double scene_depth, Random& random,
                            splatting::GaussianModel& model) {
  DensificationCounts counts;
  std::map<int, std::vector<Gaussian>> children;  // by anchor
  std::vector<uint8_t> remove(model.index_end(), 0);
  size_t room =
      static_cast<size_t>(options.max_gaussians) - std::min(model.size(), static_cast<size_t>(options.max_gaussians));
  model.for_each([&](size_t index) {
    const splatting::Statistics statistics = model.statistics(index);
    if (is_idle(options, statistics)) {
      remove[index] = 1;
      ++counts.pruned;
      return;
    }
    if (room == 0 || statistics.visible < 1) return;
    if (static_cast<double>(statistics.gradient / statistics.visible) < options.gradient_threshold) return;
    const Gaussian gaussian = model.get(index);
    std::vector<Gaussian>& siblings = children[model.anchor(index)];
    --room;
    if (largest_scale(gaussian) > options.split_size * scene_depth) {
      siblings.push_back(half_of(gaussian, random));
      siblings.push_back(half_of(gaussian, random));
      remove[index] = 1;
      ++counts.split;
    } else {
      siblings.push_back(gaussian);
      ++counts.cloned;
    }
  });
  model.remove(remove);
  for (const auto& [anchor, gaussians] : children) model.add(anchor, gaussians);
  model.reset_statistics();
  return counts;
}

size_t prune_idle(const DensificationOptions& options, splatting::GaussianModel& model) {
  const size_t removed = model.remove_if([&](size_t index) { return is_idle(options, model.statistics(index)); });
  model.reset_statistics();
  return removed;
}

size_t make_room(const DensificationOptions& options, size_t newcomers, splatting::GaussianModel& model) {
  const auto limit = static_cast<size_t>(options.max_gaussians);
  if (model.size() + newcomers <= limit) return 0;
  std::vector<std::pair<float, size_t>> order;  // mean weight in a view, index
  model.for_each([&](size_t index) {
    const splatting::Statistics s = model.statistics(index);
    if (s.visible >= kMinViews) order.emplace_back(s.weight / s.visible, index);
  });
  const size_t leaving = std::min(model.size() + newcomers - limit, order.size());
  std::ranges::nth_element(order, order.begin() + static_cast<std::ptrdiff_t>(leaving));
  std::vector<uint8_t> remove(model.index_end(), 0);
  for (size_t i = 0; i < leaving; ++i) remove[order[i].second] = 1;
  return model.remove(remove);
}

size_t prune(const DensificationOptions& options, double scene_depth, splatting::GaussianModel& model) {
  const auto min_logit = static_cast<float>(std::log(options.min_opacity / (1.0 - options.min_opacity)));
  const auto max_log_scale = static_cast<float>(std::log(options.max_scale * scene_depth));
  return model.remove_if([&](size_t index) {
    const Gaussian g = model.get(index);
    const float largest = std::max({g.log_scale[0], g.log_scale[1], g.log_scale[2]});
    const bool finite = std::isfinite(g.mean[0] + g.mean[1] + g.mean[2] + largest + g.opacity_logit);
    return !finite || g.opacity_logit < min_logit || largest > max_log_scale;
  });
}

}  // namespace photoslam
