// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "base/result.h"
#include "sources/frame.h"

namespace photoslam {

struct SourceOptions {
  std::string format = "auto";   ///< "auto", "tum" or "replica".
  std::filesystem::path camera;  ///< A camera.yaml to use instead of the dataset's own calibration; empty = its own.
};

/// Opens a dataset for reading. Images are read one by one as they are asked for.
///
/// The error says what was looked for where nothing fits. SourceInfo::notes tells what was guessed or is missing.
Result<std::unique_ptr<FrameSource>> open_source(const std::filesystem::path& path, const SourceOptions& options = {});

}  // namespace photoslam
