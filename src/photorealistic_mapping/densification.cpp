// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/densification.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "splatting/density.h"

namespace photoslam {

namespace {

using splatting::DensityRules;
using splatting::Fate;

constexpr float kMinViews = 3;  // that must have judged a gaussian

/// Idle gaussians go, none doubles.
DensityRules idle_rules(const DensificationOptions& options) {
  DensityRules rules;
  rules.by_statistics = true;
  rules.views_to_judge = kMinViews;
  rules.min_weight = options.min_weight;
  rules.gradient_threshold = std::numeric_limits<double>::infinity();
  return rules;
}

/// Opacity times solid angle [sr], up to a factor; -1 where something is not finite.
double presence(const splatting::Gaussian& g) {
  double distance2 = 0, log_scales = 0, least = std::numeric_limits<double>::infinity();
  for (const float m : g.mean) distance2 += static_cast<double>(m) * static_cast<double>(m);
  for (const float s : g.log_scale) {
    log_scales += static_cast<double>(s);
    least = std::min(least, static_cast<double>(s));
  }
  const double area = std::exp(log_scales - least);  // of the two larger extents
  const double opacity = 1.0 / (1.0 + std::exp(-static_cast<double>(g.opacity_logit)));
  const double result = opacity * area / std::max(distance2, 1e-12);
  return std::isfinite(result) ? result : -1.0;
}

/// Marks the `count` first in order, which is (rank, index): [index_end].
template <class Rank>
std::vector<uint8_t> first_of(std::vector<std::pair<Rank, size_t>>& order, size_t count, size_t index_end) {
  std::ranges::nth_element(order, order.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<uint8_t> marks(index_end, 0);
  for (size_t i = 0; i < count; ++i) marks[order[i].second] = 1;
  return marks;
}

size_t remove_by(const DensityRules& rules, splatting::GaussianModel& model) {
  const std::vector<Fate> fates = model.judge(rules);
  return model.remove_if([&](size_t index) { return fates[index] == Fate::goes; });
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
  DensityRules rules = idle_rules(options);
  rules.gradient_threshold = options.gradient_threshold;
  rules.split_log_scale = std::log(options.split_size * scene_depth);
  std::vector<Fate> fates = model.judge(rules);

  DensificationCounts counts;
  std::vector<double> normals;  // six per split
  const auto limit = static_cast<size_t>(options.max_gaussians);
  size_t room = limit - std::min(model.size(), limit);
  model.for_each([&](size_t index) {
    Fate& fate = fates[index];
    if (room == 0 && fate != Fate::goes) fate = Fate::stays;
    counts.pruned += fate == Fate::goes;
    counts.cloned += fate == Fate::clones;
    counts.split += fate == Fate::splits;
    if (fate == Fate::clones || fate == Fate::splits) --room;
    for (int i = 0; fate == Fate::splits && i < 6; ++i) normals.push_back(random.normal());
  });
  model.breed(fates, normals);
  model.reset_statistics();
  return counts;
}

size_t prune_idle(const DensificationOptions& options, splatting::GaussianModel& model) {
  const size_t removed = remove_by(idle_rules(options), model);
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
  return model.remove(first_of(order, leaving, model.index_end()));
}

size_t keep_budget(const DensificationOptions& options, splatting::GaussianModel& model) {
  const auto limit = static_cast<size_t>(options.max_gaussians);
  if (model.size() <= limit) return 0;
  std::vector<std::pair<double, size_t>> order;
  order.reserve(model.size());
  model.for_each([&](size_t index) { order.emplace_back(presence(model.get(index)), index); });
  return model.remove(first_of(order, model.size() - limit, model.index_end()));
}

size_t prune(const DensificationOptions& options, double scene_depth, splatting::GaussianModel& model) {
  DensityRules rules;
  rules.by_shape = true;
  rules.min_opacity_logit = static_cast<float>(std::log(options.min_opacity / (1.0 - options.min_opacity)));
  rules.max_log_scale = static_cast<float>(std::log(options.max_scale * scene_depth));
  return remove_by(rules, model);
}

}  // namespace photoslam
