// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace photoslam::html {

/// Text as it may stand between tags and in quoted attributes.
std::string escape(std::string_view text);

/// Base64 of arbitrary bytes (RFC 4648, padded).
std::string base64(std::string_view bytes);

}  // namespace photoslam::html
