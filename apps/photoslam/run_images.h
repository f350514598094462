// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "base/ids.h"
#include "base/result.h"
#include "image/image.h"
#include "sources/posed_cameras.h"

namespace photoslam {

/// Hands out the rectified picture of every keyframe of a run with its camera and final pose, in order of time; the
/// dataset is read again for that.
Status for_each_keyframe_image(const std::filesystem::path& run,
                               const std::function<Status(FrameId, const PosedCamera&, ImageU8)>& take);

}  // namespace photoslam
