// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/open_source.h"
#include "sources/webcam/v4l2_device.h"

namespace photoslam::internal {

/// The device of "camera:0" or "/dev/video0"; nothing of other names.
std::optional<std::string> camera_device(const std::string& name);

/// A camera as a mono source without end: read on a thread of its own, the oldest of four waiting frames dropped when
/// nobody takes them. The ids of frames that were dropped, there or by the driver, are left out. The stream ends with a
/// defect when the camera is unplugged.
Result<std::unique_ptr<FrameSource>> open_webcam(const std::string& device, const SourceOptions& options,
                                                 std::unique_ptr<DeviceCalls> calls = system_device_calls());

}  // namespace photoslam::internal
