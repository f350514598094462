// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "pipeline/run_settings.h"
#include "sources/frame.h"

namespace photoslam {

/// What a user should know of a finished run beside its figures: why frames were lost after the first pose, and whether
/// the map had hardly any training.
std::vector<std::string> notes_on(const RunOutcome& run, const RunSettings& settings);

/// Why a run has mapped nothing, and what to look at.
std::string why_nothing_was_mapped(const RunOutcome& run, SensorKind sensor);

}  // namespace photoslam
