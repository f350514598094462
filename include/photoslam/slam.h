// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "photoslam/splat_map.h"
#include "photoslam/types.h"

namespace photoslam {

/// What trains the gaussians: the GPU if there is a usable one, else the CPU; the CPU; the GPU.
enum class Backend { automatic, cpu, cuda };

struct SlamSettings {
  /// Frames are used at the pace of their timestamps, and dropped when they come too fast; otherwise none is dropped.
  bool realtime = true;
  /// The same result in every run, at any number of threads; implies realtime = false.
  bool deterministic = false;
  uint64_t seed = 1;
  int threads = 0;            ///< For mapping; 0: one per core.
  double refine_seconds = 0;  ///< Keep improving the map for so long after the last frame.
  int refine_iterations = 0;  ///< The same, counted; the only one that deterministic runs take.
  /// Backend::cuda without a GPU is a Failure. When a GPU fails on the way, the CPU goes on.
  Backend backend = Backend::automatic;
  double gpu_memory_mb = 2000;  ///< At most so much of the GPU's memory is used.
  /// Configuration values as "key=value"; `photoslam config` lists them.
  std::vector<std::string> configuration;
};

/// What came of a run.
struct SlamResult {
  int frames = 0;                      ///< All that were delivered …
  int tracked = 0;                     ///< … those with a pose …
  int dropped = 0;                     ///< … and those that came too fast.
  std::vector<CameraPose> trajectory;  ///< Final poses of the tracked frames.
  std::vector<CameraPose> keyframes;   ///< Of those among them that the map was trained on.
  CameraModel camera;                  ///< The undistorted camera that the map is rendered with.
  SplatMap map;
  std::string gpu;          ///< The GPU that trained the gaussians; empty: the CPU did …
  std::string gpu_failure;  ///< … or went on when the GPU failed, and why that was.
  /// Names the component that failed, and why; empty when all went well. The rest is what was made before.
  std::string failure;
};

/// Delivers the next frame, waiting for it if need be; nothing at the end. Called on a thread of its own.
using RgbdInput = std::function<std::optional<RgbdFrame>()>;

/// Called a few times a second with the number of frames processed; false ends the run early, keeping what was made.
using KeepGoing = std::function<bool(int frames)>;

/// Tracks and maps the frames of an RGB-D camera. `metres_per_depth_unit` is 0.001 for depth in millimetres.
/// Frames of the wrong size or without a later timestamp are counted as lost. Throws Failure for bad arguments.
SlamResult map_frames(const CameraModel& camera, double metres_per_depth_unit, const RgbdInput& next_frame,
                      const SlamSettings& settings = {}, const KeepGoing& keep_going = {});

/// Tracks and maps a dataset folder (TUM RGB-D or Replica layout). Throws Failure when it cannot be read.
SlamResult map_dataset(const std::filesystem::path& folder, const SlamSettings& settings = {},
                       const KeepGoing& keep_going = {});

}  // namespace photoslam
