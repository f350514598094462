// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "camera/pinhole.h"
#include "map/keyframe.h"

namespace photoslam {

/// Keypoints of two frames that may take part in a match.
struct EpipolarSide {
  const FeatureFrame& frame;
  std::span<const uint8_t> usable;  ///< [N]
};

/// Pairs of keypoints that look alike and agree with the relative pose of their views: in each pair, b lies on the
/// epipolar line of a. Every keypoint is in at most one pair. Deterministic.
std::vector<std::pair<int, int>> match_along_epipolar_lines(const PinholeCamera& camera, const EpipolarSide& a,
                                                            const EpipolarSide& b, const SE3& b_from_a);

}  // namespace photoslam
