// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "base/result.h"
#include "camera/pinhole.h"
#include "io/gaussian_ply.h"
#include "io/trajectory_file.h"
#include "pipeline/session_view.h"

namespace photoslam {

/// A map to look at: a map.ply, a session.photoslam, or the folder of a run or a merge. Of a folder it is map.ply or,
/// where that is missing or older, as a run that was killed leaves it, the session.
class MapInput {
 public:
  static Result<MapInput> open(const std::filesystem::path& path);

  const GaussianTable& map() const { return session_ ? session_->map : map_; }
  bool is_session() const { return session_.has_value(); }
  /// The camera that made it. An error where nothing tells.
  Result<PinholeCamera> camera() const;
  /// In the order in which they were made; none where nothing tells.
  Result<Trajectory> keyframes() const;

 private:
  explicit MapInput(std::filesystem::path path) : path_(std::move(path)) {}

  std::filesystem::path path_;
  GaussianTable map_;
  std::optional<SessionView> session_;
};

}  // namespace photoslam
