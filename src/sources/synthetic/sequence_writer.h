// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>

#include "base/executor.h"
#include "base/result.h"
#include "sources/synthetic/detail.h"
#include "sources/synthetic/synthetic_source.h"

namespace photoslam {

enum class SequenceLayout {
  tum,  ///< rgb/, depth/ (16 bit, 5000 per metre), rgb.txt, depth.txt, associations.txt, groundtruth.txt, camera.yaml.
  replica,  ///< As rendered for NICE-SLAM: results/, traj.txt and cam_params.json (16 bit, 6553.5 per metre).
};

struct SequenceSummary {
  int frames = 0;
  DetailFigures detail;  ///< Means over the frames before noise.
};

/// Films all frames of the camera into `folder`, which must not exist or be empty. Frames are made in parallel.
///
/// Writes into a folder beside it and renames at the end, so that a sequence under its name is a complete one; after
/// an error, or when *stop becomes true, nothing is left. `progress` is called with the number of finished frames,
/// one call at a time, from any thread.
Result<SequenceSummary> write_sequence(const SyntheticCamera& camera, SequenceLayout layout,
                                       const std::filesystem::path& folder, Executor& executor,
                                       const std::function<void(int)>& progress = {},
                                       const std::atomic<bool>* stop = nullptr);

}  // namespace photoslam
