// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "photorealistic_mapping/depth_picture.h"
#include "splatting/model.h"
#include "splatting/view.h"

namespace photoslam {

/// Marks gaussians of cells whose depth is borrowed from beside them, until a measurement settles it. Those at
/// features, whose depth may be interpolated, are not marked.
inline constexpr uint32_t kGuessTag = 1;

/// Holds the guesses in a view against its measured depth. Those that lie before the surface by more than `tolerance`
/// of its distance leave the map: they look right from where they were guessed, and from elsewhere hide what is there.
/// Those on the surface are guesses no more; those behind it may be hidden and stay as they are.
///
/// `camera_from_anchor`: [anchors]. Returns how many were removed; all indices change then.
size_t settle_guesses(const DepthPicture& view, std::span<const splatting::Pose> camera_from_anchor, double near_m,
                      double tolerance, splatting::GaussianModel& model);

}  // namespace photoslam
