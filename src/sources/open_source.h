// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "sources/frame.h"

namespace photoslam {

struct SourceOptions {
  std::string format = "auto";            ///< "auto" or one of source_formats().
  std::filesystem::path camera = {};      ///< A calibration to use instead of the dataset's own; empty = its own.
  double fov_deg = 0;                     ///< Horizontal field of view for a guess where there is no calibration.
  double frames_per_second = 0;           ///< Of image folders; 0 = the calibration's, or 30.
  std::optional<SensorKind> sensor = {};  ///< Guessed from the data where not given.
};

/// Names of the layouts that can be read; all but "video" are folders.
std::vector<std::string> source_formats();

/// The error says why video files cannot be read here.
Status check_video_support();

/// Every video device of this machine: its name, or why it takes no pictures for us.
std::vector<std::string> describe_cameras();

/// Whether the path names a camera, whose frames cannot be read twice.
bool is_camera(const std::filesystem::path& path);

/// Opens the folder of a dataset, a video file, or a camera ("camera:0", "/dev/video0") for reading. Images are read
/// one by one as they are asked for.
///
/// The error says what was looked for where nothing fits. SourceInfo::notes tells what was guessed or is missing.
Result<std::unique_ptr<FrameSource>> open_source(const std::filesystem::path& path, const SourceOptions& options = {});

}  // namespace photoslam
