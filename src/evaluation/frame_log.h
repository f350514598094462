// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"

namespace photoslam {

/// What became of an input frame when it was processed. All but `tracked` and `dropped` count as lost.
enum class FrameState { tracked, coasted, initializing, lost, dropped };

const char* to_string(FrameState state);

/// One line of frames.csv. Times that were not measured are unset and stay empty in the file.
struct FrameRecord {
  FrameId frame;
  int64_t timestamp_ns = 0;
  FrameState state = FrameState::lost;
  std::string reason;                   ///< Why it was not tracked.
  int inliers = 0;                      ///< Landmarks that agree with the pose.
  std::optional<double> active_ratio;   ///< Keypoints with a landmark / keypoints.
  std::optional<double> queue_wait_ms;  ///< In the input queue.
  std::optional<double> tracking_ms;    ///< Wall time of the tracking call.
  std::optional<double> blocked_ms;     ///< Wall time − CPU time of the tracking thread in it.
  std::optional<double> latency_ms;     ///< From the frame's due time to its published pose.
  KeyframeId keyframe;                  ///< If it became one.
};

using FrameLog = std::vector<FrameRecord>;

/// Writes frames.csv atomically: a header line, then every input frame in order.
Status write_frame_log(const std::filesystem::path& path, const FrameLog& log);

/// Reads it back; errors name file and line.
Result<FrameLog> read_frame_log(const std::filesystem::path& path);

}  // namespace photoslam
