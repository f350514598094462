// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace photoslam::splatting::testing {

/// SIMD targets that are compiled in and that this machine can run, as Highway's bits.
std::vector<int64_t> simd_targets();
std::string simd_target_name(int64_t target);

/// Makes dispatch choose `target` while alive.
class ScopedSimdTarget {
 public:
  explicit ScopedSimdTarget(int64_t target);
  ~ScopedSimdTarget();
  ScopedSimdTarget(const ScopedSimdTarget&) = delete;
  ScopedSimdTarget& operator=(const ScopedSimdTarget&) = delete;
};

}  // namespace photoslam::splatting::testing
