// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "image/image.h"
#include "sources/posed_cameras.h"
#include "splatting/loss.h"

namespace photoslam {

/// Pictures with their poses, as one pinhole camera sees them, and the points that came with them.
struct PosedImages {
  PinholeCamera camera;
  std::vector<SE3> poses;                                     // camera_from_world
  std::vector<ImageU8> images;                                // RGB
  std::vector<std::shared_ptr<const ImageU8>> masks;          // 0 where there is no data; null: data everywhere
  std::vector<std::optional<splatting::Exposure>> exposures;  // as a run has learnt them
  std::vector<int64_t> times_ns;                              // of a run's keyframes; else empty
  std::vector<SparsePoint> points;
  int num_resampled = 0;  // from a lens with distortion, or from another camera than the first

  /// Of one picture; empty: data everywhere.
  ImageU8 mask(size_t i) const { return masks[i] ? *masks[i] : ImageU8(); }
};

/// Reads a transforms.json, or a folder with one or with a COLMAP model. All pictures are resampled to the camera of
/// the first, without its distortion.
Result<PosedImages> read_posed_images(const std::filesystem::path& input);

/// The keyframes of a run, with the exposures that it learnt; the points are those of its map.
Result<PosedImages> read_keyframes_of_run(const std::filesystem::path& run);

}  // namespace photoslam
