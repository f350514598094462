// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"

namespace photoslam {

/// The address of a symbol in a module, which is loaded and stays so: its own threads may outlive its users. Modules
/// lie beside the program, in the folder above it, or in lib/photoslam below that. The error says what was found
/// instead.
Result<void*> find_in_module(const std::string& file_name, const std::string& symbol);

}  // namespace photoslam
