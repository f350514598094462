// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "base/ids.h"
#include "base/result.h"
#include "image/image.h"
#include "io/gaussian_ply.h"
#include "sources/posed_cameras.h"

namespace photoslam {

/// Hands out the rectified picture of every keyframe of a run with its camera and final pose, in order of time; the
/// dataset is read again for that.
Status for_each_keyframe_image(const std::filesystem::path& run,
                               const std::function<Status(FrameId, const PosedCamera&, ImageU8)>& take);

/// The most solid gaussians of a map as points, at most 20000: a start for other trainers.
std::vector<SparsePoint> sparse_points(const GaussianTable& map);

}  // namespace photoslam
