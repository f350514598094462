// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "base/executor.h"
#include "base/result.h"
#include "sources/synthetic/detail.h"
#include "sources/synthetic/synthetic_source.h"

namespace photoslam {

enum class SequenceLayout {
  tum,      ///< rgb/, depth/ (16 bit, 5000 per metre), lists of both, associations, groundtruth.txt, camera.yaml.
  replica,  ///< As rendered for NICE-SLAM: results/, traj.txt, cam_params.json (16 bit, 6553.5 per metre).
};

struct SequenceSettings {
  SequenceLayout layout = SequenceLayout::tum;
  bool lossless_color = false;  ///< PNG instead of JPEG of quality 95; TUM layout only.
};

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
