// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace photoslam {

/// Thrown by PHOTOSLAM_CHECK: the program is wrong, not its input.
class CheckError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

namespace internal {
[[noreturn]] inline void fail_check(const char* file, int line, const char* condition, const std::string& detail) {
  throw CheckError(fmt::format("{}:{}: check failed: {} {}", file, line, condition, detail));
}
}  // namespace internal

}  // namespace photoslam

/// Throws CheckError with file, line and the formatted values unless the condition holds.
/// Usage: PHOTOSLAM_CHECK(a.size() == b.size(), "{} landmarks, {} descriptors", a.size(), b.size());
#define PHOTOSLAM_CHECK(condition, ...)                                                                 \
  do {                                                                                                  \
    if (!(condition)) [[unlikely]]                                                                      \
      ::photoslam::internal::fail_check(__FILE__, __LINE__, #condition, ::fmt::format("" __VA_ARGS__)); \
  } while (false)
