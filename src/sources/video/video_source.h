// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"
#include "sources/open_source.h"

namespace photoslam::internal {

/// The image turned clockwise by 0, 90, 180 or 270°.
ImageU8 turned(const ImageU8& image, int clockwise_deg);

/// The error says why the module that decodes videos cannot be used.
Status check_decoder();

/// A video file as a mono source: times of the container, images upright. The calibration (--camera or --fov) is that
/// of the upright images. Images that cannot be decoded are frames with a defect; images whose time does not increase
/// are left out. Needs the module photoslam_video.so beside the program, or in ../lib/photoslam.
Result<std::unique_ptr<FrameSource>> open_video(const std::filesystem::path& file, const SourceOptions& options);

}  // namespace photoslam::internal
