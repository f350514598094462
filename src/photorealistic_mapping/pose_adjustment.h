// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "base/options.h"
#include "math/se3.h"

namespace photoslam {

class Archive;

struct PoseAdjustmentOptions {
  bool enabled = true;
  double translation_rate = 1.5e-4;
  double rotation_rate_deg = 0.01;
  void visit(OptionVisitor& visitor);
};

/// Photometric correction of one keyframe's pose: a left twist of its camera, followed by Adam.
class PoseAdjustment {
 public:
  const SE3& correction() const { return correction_; }
  /// The unit of length has changed: lengths grow by the factor.
  void rescale(double factor);

  /// One step against the gradient dL/dξ of T ← exp(ξ) T (translation first); `scene_depth` scales translations.
  void step(const PoseAdjustmentOptions& options, double scene_depth, double rate_factor,
            std::span<const float, 6> gradient);
  void serialize(Archive& archive);

 private:
  SE3 correction_;
  Vec6 first_moment_ = Vec6::Zero();
  Vec6 second_moment_ = Vec6::Zero();
  int steps_ = 0;
};

}  // namespace photoslam
