// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "base/version.h"

#include <fmt/format.h>

namespace photoslam {

std::string_view version() { return PHOTOSLAM_VERSION; }

std::string build_description() {
  constexpr std::string_view sanitizers = PHOTOSLAM_SANITIZERS;
  return fmt::format("{} {}, {}, {}{}{}", PHOTOSLAM_COMPILER, PHOTOSLAM_COMPILER_VERSION, PHOTOSLAM_BUILD_TYPE,
                     PHOTOSLAM_TARGET, sanitizers.empty() ? "" : ", sanitizers ", sanitizers);
}

}  // namespace photoslam
