// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "evaluation/report.h"

namespace photoslam {

/// The figures of a report that people look at first, one per line; those not measured are left out.
std::string result_table(const Report& report);

}  // namespace photoslam
