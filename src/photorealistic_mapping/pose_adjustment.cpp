// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/pose_adjustment.h"

#include <cmath>
#include <numbers>

namespace photoslam {

void PoseAdjustmentOptions::visit(OptionVisitor& v) {
  v.value({"enabled", "", 0, 0, "Refine keyframe poses by the photometric loss."}, enabled);
  v.value({"translation_rate", "", 0.0, 0.1, "Step size of Adam, relative to the depth of the scene."},
          translation_rate);
  v.value({"rotation_rate_deg", "deg", 0.0, 1.0, "Step size of Adam."}, rotation_rate_deg);
}

void PoseAdjustment::rescale(double factor) {
  correction_.translation *= factor;
  first_moment_.head<3>() /= factor;
  second_moment_.head<3>() /= factor * factor;
}

void PoseAdjustment::step(const PoseAdjustmentOptions& options, double scene_depth, double rate_factor,
                          std::span<const float, 6> gradient) {
  constexpr double kBeta1 = 0.9, kBeta2 = 0.99, kEpsilon = 1e-12;
  Vec6 g;
  for (int i = 0; i < 6; ++i) g[i] = static_cast<double>(gradient[static_cast<size_t>(i)]);
  if (!g.allFinite()) return;
  ++steps_;
  first_moment_ = kBeta1 * first_moment_ + (1 - kBeta1) * g;
  second_moment_ = kBeta2 * second_moment_ + (1 - kBeta2) * g.cwiseProduct(g);
  const Vec6 mean = first_moment_ / (1 - std::pow(kBeta1, steps_));
  const Vec6 variance = second_moment_ / (1 - std::pow(kBeta2, steps_));
  Vec6 twist = -mean.cwiseQuotient((variance.array().sqrt() + kEpsilon).matrix());
  twist.head<3>() *= rate_factor * options.translation_rate * scene_depth;
  twist.tail<3>() *= rate_factor * options.rotation_rate_deg * std::numbers::pi / 180.0;
  correction_ = SE3::exp(twist) * correction_;
}

}  // namespace photoslam
