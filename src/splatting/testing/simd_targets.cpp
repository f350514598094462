// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/testing/simd_targets.h"

#include "splatting/cpu/targets.h"
//
#include "hwy/highway.h"

namespace photoslam::splatting::testing {
namespace {

// With a single target compiled in (as on ARM) there is nothing to choose, and Highway has no table of choices.
#if (HWY_TARGETS & (HWY_TARGETS - 1)) != 0
int64_t supported_targets() { return hwy::SupportedTargets(); }
void choose(int64_t targets) {
  hwy::SetSupportedTargetsForTest(targets);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}
#else
int64_t supported_targets() { return HWY_TARGETS; }
void choose(int64_t) {}
#endif

}  // namespace

std::vector<int64_t> simd_targets() {
  std::vector<int64_t> targets;
  for (uint64_t rest = static_cast<uint64_t>(supported_targets() & HWY_TARGETS); rest != 0; rest &= rest - 1)
    targets.push_back(static_cast<int64_t>(rest & (~rest + 1)));
  return targets;
}

std::string simd_target_name(int64_t target) { return hwy::TargetName(target); }

ScopedSimdTarget::ScopedSimdTarget(int64_t target) { choose(target); }
ScopedSimdTarget::~ScopedSimdTarget() { choose(0); }

}  // namespace photoslam::splatting::testing
