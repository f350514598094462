// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// To be included before Highway. The compiled SIMD targets: SSE4 as the baseline of x86, AVX2, AVX3 (AVX-512), NEON.
// One-lane and intermediate targets would only cost build time.
#define HWY_WANT_SSE4 1
#define HWY_DISABLED_TARGETS (HWY_SCALAR | HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
