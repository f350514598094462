// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "camera/pinhole.h"
#include "io/trajectory_file.h"
#include "photorealistic_mapping/world_export.h"
#include "pipeline/run_settings.h"
#include "sources/open_source.h"

namespace photoslam {

inline constexpr const char* kExposuresFile = "exposures.txt";
inline constexpr const char* kMapCameraFile = "map_camera.yaml";  // of the map of `train`

/// Where a run's input came from and with what camera its map is rendered: run.json in the run's folder. Paths of files
/// are absolute there; a live camera keeps the name it was given.
struct RunDescription {
  std::filesystem::path dataset;
  SourceOptions source;
  PinholeCamera camera;
  int hold_out = 0;
};

Status write_run_description(const std::filesystem::path& folder, const RunDescription& description);
Result<RunDescription> read_run_description(const std::filesystem::path& folder);

/// Opens the source of a run again, to read the same frames. An error after a run on a live camera: its frames are
/// gone.
Result<std::unique_ptr<FrameSource>> open_run_source(const std::filesystem::path& folder,
                                                     const RunDescription& description);

/// The exposures of a run's keyframes; none for a run that is older than they are.
Result<ExposureTrack> read_run_exposures(const std::filesystem::path& folder);

/// Writes trajectory.tum, trajectory_online.tum, keyframes.tum, frames.csv, exposures.txt and map.ply, each atomically.
/// Poses are those of RunDescription::camera: undistorted, and of a stereo pair the rectified left camera.
/// map.ply holds the gaussians of the world that the trajectories are in; the session holds all. Sets `map_bytes` to
/// the size of map.ply.
Status write_run_results(const std::filesystem::path& folder, const RunOutcome& run, size_t& map_bytes);

}  // namespace photoslam
