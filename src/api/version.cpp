// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photoslam/version.h"

#include "base/version.h"

namespace photoslam {

std::string_view library_version() { return version(); }

}  // namespace photoslam
