// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace photoslam::splatting {

/// Blending weights below 1/255 do not count; −log2(1/255).
inline constexpr float kLog2Cut = 7.9943534368588578f;
inline constexpr float kMaxAlpha = 0.99f;
inline constexpr float kMinTransmittance = 1e-4f;

}  // namespace photoslam::splatting
