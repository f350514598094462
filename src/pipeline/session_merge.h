// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/archive.h"
#include "base/executor.h"
#include "base/result.h"
#include "pipeline/system_options.h"

namespace photoslam {

/// Two maps of the same place in one, in the world of the first.
struct MergedSessions {
  Archive session;
  FrozenMap map;
  std::vector<int64_t> keyframe_times_ns;  ///< [K]
  std::vector<int> component_of_keyframe;  ///< [K]
  int num_keyframes_of_first = 0;
  int num_loops = 0;  ///< Places of the second map that were recognised in the first, or in the second itself.
};

/// Recognises places of the first session in the second, brings both maps together there, adjusts all, and trains where
/// that leaves seams. Both are the bytes of sessions of the same camera. An error where no place is known to both.
Result<MergedSessions> merge_sessions(const SystemOptions& options, const std::string& first, const std::string& second,
                                      Executor& executor);

}  // namespace photoslam
