// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include "base/executor.h"
#include "base/result.h"
#include "sources/synthetic/detail.h"
#include "sources/synthetic/synthetic_source.h"

namespace photoslam {

enum class SequenceLayout {
  tum,      ///< rgb/, depth/ (16 bit, 5000 per metre), lists of both, associations, groundtruth.txt, camera.yaml.
  replica,  ///< As rendered for NICE-SLAM: results/, traj.txt, cam_params.json (16 bit, 6553.5 per metre).
  euroc,    ///< EuRoC ASL: mav0/cam0, cam1, state_groundtruth_estimate0; the body's axes differ from the camera's.
  kitti,    ///< KITTI odometry: sequences/00 with image_2 and image_3 (colour), calib.txt, times.txt; poses/00.txt.
};

struct SequenceSettings {
  SequenceLayout layout = SequenceLayout::tum;
  bool lossless_color = false;  ///< PNG instead of JPEG of quality 95; KITTI's images are always PNG.
};

/// Whether the layout can hold what the camera delivers: depth goes with tum and replica, stereo with euroc and kitti,
/// lens distortion with tum and euroc.
Status check_layout(SequenceLayout layout, const SyntheticOptions& options);

/// Whether a sequence may be written there: the folder must not exist or be empty, and what is above it must be
/// writable.
Status check_sequence_folder(const std::filesystem::path& folder);

struct SequenceSummary {
  int frames = 0;
  DetailFigures detail;  ///< Means over every tenth frame, before noise and compression.
};

/// Films all frames of the camera into `folder`, which must not exist or be empty. Frames are made in parallel.
///
/// Writes into a folder beside it and renames at the end, so that a sequence under its name is a complete one; after
/// an error or a stop request, which is an error too, nothing is left. `progress` is called with the number of
/// finished frames, one call at a time, from any thread.
Result<SequenceSummary> write_sequence(const SyntheticCamera& camera, const SequenceSettings& settings,
                                       const std::filesystem::path& folder, Executor& executor,
                                       const std::function<void(int)>& progress = {}, std::stop_token stop = {});

}  // namespace photoslam
