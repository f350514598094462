// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "sources/frame.h"

namespace photoslam {

/// A frame stored as image files.
struct ListedFrame {
  int64_t timestamp_ns = 0;
  std::filesystem::path color;
  std::filesystem::path depth;  ///< Empty but with RGB-D sensors.
  std::filesystem::path right;  ///< Empty but with stereo sensors.
};

/// Depth values per metre: as calibrated, or else the layout's usual ones, which `info` then notes.
void set_depth_unit(std::optional<double> depth_scale, double usual, SourceInfo& info);

struct FrameSize {
  int width = 0, height = 0;
};
/// Size of the first image that can be read.
Result<FrameSize> image_size(const std::vector<ListedFrame>& frames);

/// A source that reads the listed frames, in strictly increasing time, one by one as they are asked for.
///
/// `info` comes with everything but num_frames; a frame rate of 0 is replaced by that of the median step, a camera of
/// width 0 gets the size of the images. Listed files
/// that do not exist are named in its notes and their frames delivered with a defect; where fewer than a tenth of the
/// frames exist, or the images are not of the camera's size, the result is an error.
Result<std::unique_ptr<FrameSource>> make_image_list_source(SourceInfo info, std::vector<ListedFrame> frames);

}  // namespace photoslam
