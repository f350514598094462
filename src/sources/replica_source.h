// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sources/open_source.h"

namespace photoslam::internal {

/// Frame rate of Replica sequences, which carry no times.
inline constexpr int kReplicaFramesPerSecond = 30;

/// Time of a frame by its number.
constexpr int64_t replica_time_ns(int64_t number) { return number * 1'000'000'000 / kReplicaFramesPerSecond; }

/// Whether the folder, or the folder itself being `results`, has images named as in Replica.
bool looks_like_replica(const std::filesystem::path& folder);

/// Replica as rendered for NICE-SLAM: results/frame000000.jpg, results/depth000000.png, cam_params.json inside the
/// scene or beside it. Frame n is at n / 30 s.
Result<std::unique_ptr<FrameSource>> open_replica(const std::filesystem::path& folder, const SourceOptions& options);

}  // namespace photoslam::internal
