// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "base/executor.h"
#include "base/options.h"
#include "camera/pinhole.h"
#include "image/image.h"
#include "math/se3.h"

namespace photoslam {

struct DepthSweepOptions {
  int max_hypotheses = 64;
  double small_penalty = 0.06;
  double large_penalty = 0.35;
  double max_cost = 0.30;
  double min_margin = 0.04;
  void visit(OptionVisitor& visitor);
};

/// Another picture of the same scene.
struct SweepView {
  const ImageU8* grey = nullptr;
  PinholeCamera camera;
  SE3 camera_from_reference;
};

/// Nearest and farthest depth to look for [m].
struct DepthRange {
  double nearest = 0;
  double farthest = 0;
};

/// Dense depth of a picture from others of known pose: the right image of a stereo rig, neighbouring keyframes, or
/// both.
///
/// A plane is swept through the range in equal steps of inverse depth, about a pixel wide in the view that moves most
/// (Collins 1996). Census signatures (Zabih and Woodfill 1994) compare the pictures, so exposure does not matter; costs
/// are summed along four directions with penalties for steps in depth (Hirschmüller 2008) and refined between steps.
///
/// Returns metres [H, W], 0 where no view sees the pixel, something nearer hides it there, or the match is poor or
/// ambiguous. The same at any concurrency.
ImageF sweep_depth(const DepthSweepOptions& options, const ImageU8& grey, const PinholeCamera& camera,
                   std::span<const SweepView> views, const DepthRange& range, Executor& executor);

}  // namespace photoslam
