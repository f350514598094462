// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace photoslam {

/// Version of this build, such as "0.1.0".
std::string_view version();

/// How it was built, in one line: compiler, build type, target, sanitizers.
std::string build_description();

}  // namespace photoslam
