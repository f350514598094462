// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Colours of a block of gaussians; included once per SIMD target.
#if defined(PHOTOSLAM_SPLATTING_COLORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PHOTOSLAM_SPLATTING_COLORS_INL_H
#undef PHOTOSLAM_SPLATTING_COLORS_INL_H
#else
#define PHOTOSLAM_SPLATTING_COLORS_INL_H
#endif

#include <algorithm>

#include "hwy/highway.h"
#include "splatting/cpu/lanes-inl.h"
#include "splatting/model.h"

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

/// Values of the spherical-harmonic basis in the viewing directions of a block's gaussians.
using ShBasis = float[kNumShCoefficients][kBlockSize];
inline constexpr size_t kParts = kBlockSize / kLanes;  ///< Vectors per row of a block.

/// Parameter rows that are fetched ahead of their use.
inline constexpr int kRowsAhead = 16;

/// Fetches vector `part` of the row `kRowsAhead` after row r, counting on into the next block (or null).
HWY_INLINE void prefetch_row(const Block& block, const Block* next, int rows, int r, size_t part) {
  const Block* of = r + kRowsAhead < rows ? &block : next;
  const int ahead = r + kRowsAhead < rows ? r + kRowsAhead : r + kRowsAhead - rows;
  if (of != nullptr && part * kLanes % 16 == 0) __builtin_prefetch(of->parameters[ahead] + part * kLanes);
}

/// out[c] = Σ_k basis[k] sh[k][c] + 1/2 for the vectors whose bit is set in `parts`. Rows are read in the order of
/// memory, four vectors at a time.
HWY_INLINE void block_colors(const Block& block, const Block* next, const ShBasis& basis, int degree, uint32_t parts,
                             float (*out)[kBlockSize]) {
  constexpr size_t kGroup = std::min<size_t>(4, kParts);
  const int coefficients = num_sh_coefficients(degree), rows = row::kSh + 3 * coefficients;
  for (size_t first = 0; first < kParts; first += kGroup) {
    const uint32_t wanted = (parts >> first) & ((1u << kGroup) - 1);
    if (wanted == 0) continue;
    Vec sums[3][kGroup];
    for (auto& channel : sums)
      for (Vec& sum : channel) sum = hn::Set(kFloats, 0.5f);
    for (int k = 0; k < coefficients; ++k)
      for (int c = 0; c < 3; ++c)
        for (size_t i = 0; i < kGroup; ++i) {
          if (((wanted >> i) & 1) == 0) continue;
          const int r = row::kSh + 3 * k + c;
          prefetch_row(block, next, rows, r, first + i);
          const size_t lane = (first + i) * kLanes;
          sums[c][i] =
              hn::MulAdd(hn::Load(kFloats, basis[k] + lane), hn::Load(kFloats, block.parameters[r] + lane), sums[c][i]);
        }
    for (size_t c = 0; c < 3; ++c)
      for (size_t i = 0; i < kGroup; ++i) hn::Store(sums[c][i], kFloats, out[c] + (first + i) * kLanes);
  }
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
