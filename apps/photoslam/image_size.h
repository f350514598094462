// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace photoslam {

struct ImageSize {
  int width = 0, height = 0;
};

/// The value of --size: "480x640". Throws CLI::ValidationError for anything else.
ImageSize parse_image_size(const std::string& text);

}  // namespace photoslam
