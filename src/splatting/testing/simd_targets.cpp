// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/testing/simd_targets.h"

#include "splatting/cpu/targets.h"
//
#include "hwy/highway.h"

namespace photoslam::splatting::testing {
namespace {

void choose(int64_t targets) {
  hwy::SetSupportedTargetsForTest(targets);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace

std::vector<int64_t> simd_targets() {
  std::vector<int64_t> targets;
  for (uint64_t rest = static_cast<uint64_t>(hwy::SupportedTargets() & HWY_TARGETS); rest != 0; rest &= rest - 1)
    targets.push_back(static_cast<int64_t>(rest & (~rest + 1)));
  return targets;
}

std::string simd_target_name(int64_t target) { return hwy::TargetName(target); }

ScopedSimdTarget::ScopedSimdTarget(int64_t target) { choose(target); }
ScopedSimdTarget::~ScopedSimdTarget() { choose(0); }

}  // namespace photoslam::splatting::testing
