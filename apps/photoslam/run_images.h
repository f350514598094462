// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "base/ids.h"
#include "base/result.h"
#include "image/image.h"
#include "io/gaussian_ply.h"
#include "sources/posed_cameras.h"

namespace photoslam {

/// The rectified picture of a keyframe, its camera and its final pose.
struct KeyframeImage {
  FrameId frame;
  int64_t timestamp_ns = 0;
  PosedCamera camera;
  ImageU8 image;
  std::shared_ptr<const ImageU8> mask;  ///< 0 where it has no data; null: data everywhere.
};

/// Hands out the keyframes of a run in order of time; the dataset is read again for that.
Status for_each_keyframe_image(const std::filesystem::path& run, const std::function<Status(KeyframeImage)>& take);

/// The most solid gaussians of a map as points, at most 20000: a start for other trainers.
std::vector<SparsePoint> sparse_points(const GaussianTable& map);

}  // namespace photoslam
