// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// As much of fmt as error messages of splatting/ and base/ need, for machines without the package: "{}" is replaced,
// whatever stands between the braces.

#include <sstream>
#include <string>
#include <string_view>

namespace fmt {

template <class... Args>
using format_string = std::string_view;  // NOLINT(readability-identifier-naming): fmt's name

template <class... Args>
std::string format(std::string_view text, const Args&... args) {
  std::ostringstream out;
  const auto until_brace = [&] {
    const size_t open = text.find('{');
    out << text.substr(0, open);
    const size_t close = open == std::string_view::npos ? open : text.find('}', open);
    text = close == std::string_view::npos ? std::string_view() : text.substr(close + 1);
  };
  ((until_brace(), out << args), ...);
  out << text;
  return out.str();
}

}  // namespace fmt
