// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "sources/frame.h"

namespace photoslam {

/// An RGB-D frame stored as two image files.
struct ListedFrame {
  int64_t timestamp_ns = 0;
  std::filesystem::path color;
  std::filesystem::path depth;
};

/// A source that reads the listed frames, in strictly increasing time, one by one as they are asked for.
///
/// `info` comes with everything but num_frames. Listed files that do not exist are named in its notes and their frames
/// delivered with a defect; where fewer than a tenth of the frames exist, or the images are not of the camera's size,
/// the result is an error.
Result<std::unique_ptr<FrameSource>> make_image_list_source(SourceInfo info, std::vector<ListedFrame> frames);

}  // namespace photoslam
