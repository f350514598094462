// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "io/trajectory_file.h"
#include "localization/tracker.h"
#include "photorealistic_mapping/exposure_file.h"
#include "photorealistic_mapping/photorealistic_mapper.h"

namespace photoslam {

enum class Pace {
  realtime,  ///< Frames are released at their timestamps; those that come too fast are dropped and counted.
  asap,      ///< No waiting, nothing dropped.
};

/// What a run is asked to do. How well each component does it is configured in SystemOptions.
struct RunSettings {
  Pace pace = Pace::realtime;
  bool deterministic = false;  ///< Logical time: the same output bytes at any thread count.
  uint64_t seed = 1;
  int threads = 0;            ///< For mapping; 0: one per core.
  double refine_seconds = 0;  ///< Training after the input has ended …
  int refine_iterations = 0;  ///< … or so many iterations.
  int hold_out = 0;           ///< Every so many-th frame is tracked but never mapped; 0: none.
  double map_until_s = std::numeric_limits<double>::infinity();  ///< Later frames are tracked only.
  bool preview = false;       ///< Progress carries pictures of what is being mapped, about once a second.
  bool logical_time = false;  ///< Tracking waits for the mapper; set by deterministic, or to spend a fixed number of
                              ///< iterations per frame.
  std::shared_ptr<const std::string> loaded_session;  ///< Bytes that check_session() accepts; none: a new map.
  bool localize_only = false;                         ///< Track in the loaded map and leave it as it is.
  std::filesystem::path session_file;                 ///< Where the session goes at the end; empty: nowhere …
  double autosave_s = 0;                              ///< … and in between, this often; 0: never.
  std::shared_ptr<splatting::Gpu> gpu;                ///< To splat and undistort on; null: the CPU.
};

/// What became of one input frame.
struct FrameOutcome {
  FrameId frame;
  int64_t timestamp_ns = 0;
  bool dropped = false;
  bool held_out = false;
  TrackingState state = TrackingState::initializing;
  std::string reason;
  int num_features = 0;
  int num_inliers = 0;
  double queue_wait_ms = 0, tracking_ms = 0, blocked_ms = 0;
  std::optional<double> latency_ms;  ///< At real-time pace: from the due time to the published pose.
  KeyframeId keyframe;               ///< If it became one.
  bool has_pose = false;
  SE3 online_camera_from_world;  ///< As published at the time.
  KeyframeId reference;
  SE3 camera_from_reference;     ///< The final pose follows the reference keyframe …
  double reference_scale = 1.0;  ///< … as it grows from this Keyframe::scale on.
};

/// One point of the quality curve of the refinement.
struct RefinementPoint {
  double seconds = 0;
  int iterations = 0;
  double training_psnr_db = 0;
  size_t gaussians = 0;
};

/// What a run took of its GPU; see splatting::Gpu.
struct GpuUse {
  double peak_mb = 0;
  double busy_seconds = 0;
  std::string undistortion_failure = {};  ///< Why the CPU undistorted frames in the end; empty: all went well.
};

struct RunOutcome {
  std::vector<FrameOutcome> frames;  ///< Every input frame, in order.
  FrozenMap online;                  ///< When all keyframes were consumed, at most 1 s after the last frame.
  FrozenMap final;                   ///< After refinement.
  int iterations = 0;
  int loops_closed = 0;
  int loops_reconnected = 0;           ///< Times that tracking itself came back to an old part of the map.
  int keyframes_without_pictures = 0;  ///< They waited for photorealistic mapping, and were too many.
  double mapping_cpu_seconds = 0;
  double seconds_online = 0, seconds_drain = 0, seconds_refine = 0, seconds_total = 0;
  std::optional<GpuUse> gpu;  ///< Nothing: there was none.
  std::vector<RefinementPoint> refinement;
  std::vector<int> component_of_keyframe;  ///< [K] See connected_components(); empty: all are connected.
  bool interrupted = false;                ///< Stopped from outside before the input ended.
  std::string failure;                     ///< "component: what"; empty when all went well.
  std::vector<std::string> messages;       ///< As in Progress, those that it has not told.
};

/// Pose of a frame in a frozen map; nothing for frames without a pose or whose keyframe the map does not hold.
std::optional<SE3> camera_from_world(const FrameOutcome& frame, const FrozenMap& map);

/// The frames whose poses are in the same world as most others: after a loss that was never bridged, the frames on one
/// side of it have poses that mean nothing to those on the other.
std::vector<FrameOutcome> connected_frames(const RunOutcome& run);

/// [K] 1 for the keyframes in that world, 0 for the others. Without any tracked frame it is that of the first keyframe.
std::vector<uint8_t> connected_keyframes(const RunOutcome& run);

/// Poses of all connected frames in the final map, as published online, and of the keyframes.
Trajectory final_trajectory(const RunOutcome& run);
Trajectory online_trajectory(const RunOutcome& run);
Trajectory keyframe_trajectory(const RunOutcome& run);

/// The exposures that a map has for the keyframes made in this run.
ExposureTrack keyframe_exposures(const RunOutcome& run, const FrozenMap& map);

}  // namespace photoslam
