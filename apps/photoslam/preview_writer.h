// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/clock.h"
#include "pipeline/system.h"

namespace photoslam {

/// The picture of `--preview`: left the newest keyframe with its features (green where geometry tracks a landmark,
/// orange elsewhere), in the middle its render, right the way of the camera from above (x to the right, z up, the
/// newest position marked). Replaced atomically, at most once a second.
ImageU8 compose_preview(const Progress& progress);

class PreviewWriter {
 public:
  /// An empty path: nothing is written.
  explicit PreviewWriter(std::filesystem::path path) : path_(std::move(path)) {}
  void show(const Progress& progress);
  /// Why the picture could not be written the last time; empty when it could.
  const std::string& failure() const { return failure_; }

 private:
  std::filesystem::path path_;
  Stopwatch since_last_;
  bool first_ = true;
  std::string failure_;
};

}  // namespace photoslam
