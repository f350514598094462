// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace photoslam::splatting {

inline constexpr int kSsimRadius = 5;
inline constexpr float kSsimC1 = 0.01f * 0.01f, kSsimC2 = 0.03f * 0.03f;

/// exp(−k² / (2 1.5²)), normalised over the 11 taps; kSsimTapK belongs to distance K. (Scalars: device code cannot
/// index constants of the host.)
inline constexpr float kSsimTap0 = 0.26601172f, kSsimTap1 = 0.21300554f, kSsimTap2 = 0.10936069f;
inline constexpr float kSsimTap3 = 0.03600077f, kSsimTap4 = 0.00759876f, kSsimTap5 = 0.00102838f;

}  // namespace photoslam::splatting
