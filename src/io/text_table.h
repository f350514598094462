// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "base/result.h"

namespace photoslam {

/// One line of a text table: its 1-based number in the file and its fields, which point into the file's content.
struct TextLine {
  int number = 0;
  std::vector<std::string_view> fields;
};

/// Splits text into lines of fields separated by blanks, tabs or commas. Empty lines and what follows '#' are left out.
std::vector<TextLine> split_table(std::string_view content);

/// A finite decimal number that takes up the whole text.
Result<double> parse_number(std::string_view text);

}  // namespace photoslam
