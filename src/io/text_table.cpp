// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "io/text_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace photoslam {
namespace {

std::vector<std::string_view> split_fields(std::string_view line) {
  constexpr std::string_view kSeparators = " \t\r\v\f,";
  std::vector<std::string_view> fields;
  size_t begin = line.find_first_not_of(kSeparators);
  while (begin != std::string_view::npos) {
    const size_t end = std::min(line.find_first_of(kSeparators, begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kSeparators, end);
  }
  return fields;
}

}  // namespace

std::vector<TextLine> split_table(std::string_view content) {
  std::vector<TextLine> lines;
  for (int number = 1; !content.empty(); ++number) {
    const size_t end = std::min(content.find('\n'), content.size());
    const std::string_view line = content.substr(0, end);
    content.remove_prefix(std::min(end + 1, content.size()));
    std::vector<std::string_view> fields = split_fields(line.substr(0, line.find('#')));
    if (!fields.empty()) lines.push_back({number, std::move(fields)});
  }
  return lines;
}

Result<double> parse_number(std::string_view text) {
  std::string_view digits = text;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  double value = 0;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (code != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value)) {
    return error("'{}' is not a number", text.substr(0, 40));
  }
  return value;
}

}  // namespace photoslam
