// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Evaluation of splats on 4x4 cells of a tile; included once per SIMD target.
#if defined(PHOTOSLAM_SPLATTING_CELLS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PHOTOSLAM_SPLATTING_CELLS_INL_H
#undef PHOTOSLAM_SPLATTING_CELLS_INL_H
#else
#define PHOTOSLAM_SPLATTING_CELLS_INL_H
#endif

#include "hwy/highway.h"
#include "splatting/cpu/frame.h"
#include "splatting/cpu/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

/// Column and row of each pixel of a cell, in the order of the lanes.
alignas(64) inline constexpr float kCellX[kCellPixels] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
alignas(64) inline constexpr float kCellY[kCellPixels] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
inline constexpr size_t kVectorsPerCell = kCellPixels / kLanes;

/// Entries blended between two looks at which cells are finished; their splats are copied to where they stay in L1.
inline constexpr size_t kBatchSize = 64;

/// A splat as a tile sees it.
struct alignas(64) LocalSplat {
  Splat splat;
  float cell_u[kCellsPerRow];  ///< Position relative to the corners of the tile's cell columns …
  float cell_v[kCellsPerRow];  ///< … and rows.
};

/// Copies entries [begin, begin + count) of a tile, and fetches the batch after them into the caches.
HWY_INLINE void gather_batch(const Frame& frame, uint32_t begin, size_t count, uint32_t end, int x0, int y0,
                             LocalSplat* batch) {
  alignas(32) static constexpr float kCorner[kCellsPerRow] = {0, 4, 8, 12, 16, 20, 24, 28};
  const hn::CappedTag<float, kCellsPerRow> d;
  for (size_t i = 0; i < count; ++i) {
    const uint32_t ahead = begin + static_cast<uint32_t>(i + kBatchSize);
    if (ahead < end) __builtin_prefetch(&frame.splats[frame.entries[ahead].slot]);
    LocalSplat& local = batch[i];
    local.splat = frame.splats[frame.entries[begin + i].slot];
    const auto u = hn::Set(d, local.splat.u - static_cast<float>(x0));
    const auto v = hn::Set(d, local.splat.v - static_cast<float>(y0));
    for (size_t k = 0; k < kCellsPerRow; k += hn::Lanes(d)) {
      hn::Store(hn::Sub(u, hn::Load(d, kCorner + k)), d, local.cell_u + k);
      hn::Store(hn::Sub(v, hn::Load(d, kCorner + k)), d, local.cell_v + k);
    }
  }
}

/// A splat's parameters in every lane.
struct SplatLanes {
  Vec slope, ka, kc, log2_opacity;
  HWY_INLINE explicit SplatLanes(const Splat& s)
      : slope(hn::Set(kFloats, s.slope)),
        ka(hn::Set(kFloats, s.ka)),
        kc(hn::Set(kFloats, s.kc)),
        log2_opacity(hn::Set(kFloats, s.log2_opacity)) {}
};

/// One splat on the pixels of one vector.
struct Coverage {
  Vec t, dy;
  Vec log2_alpha;
};

/// Part `part` of cell (column, row).
HWY_INLINE Coverage cover(const LocalSplat& local, const SplatLanes& s, size_t column, size_t row, size_t part) {
  Coverage c;
  const Vec dx = hn::Sub(hn::Load(kFloats, kCellX + part * kLanes), hn::Set(kFloats, local.cell_u[column]));
  c.dy = hn::Sub(hn::Load(kFloats, kCellY + part * kLanes), hn::Set(kFloats, local.cell_v[row]));
  c.t = hn::NegMulAdd(s.slope, c.dy, dx);
  const Vec inner = hn::MulAdd(hn::Mul(c.dy, c.dy), s.kc, s.log2_opacity);
  c.log2_alpha = hn::MulAdd(hn::Mul(c.t, c.t), s.ka, inner);
  return c;
}

/// For each splat of a batch, the cells that hold a pixel centre inside its cut ellipse, as bits 8 row + column; up to
/// a sliver more, never less. One splat per lane.
HWY_INLINE void touched_cells(const LocalSplat* batch, size_t count, uint64_t* masks) {
  using Bits = hn::RebindToUnsigned<Floats>;
  constexpr Bits bits;
  enum Field { kU, kV, kSlope, kKc, kCut, kInvKa, kPeak, kExtent, kFields };
  alignas(64) float fields[kFields][kBatchSize];
  for (size_t i = 0; i < count; ++i) {
    const Splat& s = batch[i].splat;
    const float values[kFields] = {batch[i].cell_u[0], batch[i].cell_v[0], s.slope,   s.kc, s.cut,
                                   s.inv_ka,           s.peak_dy,          s.extent_y};
    for (int k = 0; k < kFields; ++k) fields[k][i] = values[k];
  }
  // Adding this rounds to an integer and leaves it in the low mantissa bits.
  const Vec magic = hn::Set(kFloats, 12582912.0f), zero = hn::Zero(kFloats), eight = hn::Set(kFloats, 8.0f);
  const Vec quarter = hn::Set(kFloats, 0.25f), sliver = hn::Set(kFloats, 1.0f / 1024);
  const auto all = hn::Set(bits, 0xFF), low_bits = hn::Set(bits, 15);
  const auto round = [&](Vec x) HWY_ATTR {
    return hn::And(hn::BitCast(bits, hn::Add(hn::Min(hn::Max(x, zero), eight), magic)), low_bits);
  };
  for (size_t i = 0; i < count; i += kLanes) {
    const auto field = [&](Field f) HWY_ATTR { return hn::Load(kFloats, fields[f] + i); };
    const Vec u = field(kU), v = field(kV), slope = field(kSlope), kc = field(kKc), cut = field(kCut);
    const Vec inv_ka = field(kInvKa), peak = field(kPeak), extent = field(kExtent);
    const Vec minus_peak = hn::Neg(peak), minus_extent = hn::Neg(extent);
    auto low_mask = hn::Zero(bits), high_mask = hn::Zero(bits);
    for (int row = 7; row >= 0; --row) {
      // The ellipse between the row's first and last line of pixel centres: its widest points are at ±peak, or at the
      // nearer line.
      const Vec top = hn::Sub(hn::Set(kFloats, static_cast<float>(row * kCellSize)), v);
      const Vec low = hn::Max(top, minus_extent);
      const Vec high = hn::Min(hn::Add(top, hn::Set(kFloats, kCellSize - 1.0f)), extent);
      const Vec dy_right = hn::Min(hn::Max(peak, low), high), dy_left = hn::Min(hn::Max(minus_peak, low), high);
      const Vec square_right = hn::Mul(hn::MulAdd(hn::Mul(dy_right, dy_right), kc, cut), inv_ka);
      const Vec square_left = hn::Mul(hn::MulAdd(hn::Mul(dy_left, dy_left), kc, cut), inv_ka);
      const Vec right = hn::Add(hn::MulAdd(slope, dy_right, u), hn::Sqrt(hn::Max(square_right, zero)));
      const Vec left = hn::Sub(hn::MulAdd(slope, dy_left, u), hn::Sqrt(hn::Max(square_left, zero)));
      // Columns from ceil((left − 3) / 4) up to floor(right / 4); `past` is one more.
      const auto first = round(hn::MulAdd(left, quarter, hn::Sub(hn::Set(kFloats, -0.25f), sliver)));
      const auto past = round(hn::MulAdd(right, quarter, hn::Add(hn::Set(kFloats, 0.5f), sliver)));
      auto mask = hn::And(hn::Shl(all, first), hn::Shr(all, hn::Sub(hn::Set(bits, 8), past)));
      mask = hn::IfThenElseZero(hn::RebindMask(bits, hn::Le(low, high)), mask);
      auto& half = row >= 4 ? high_mask : low_mask;
      half = hn::Or(hn::ShiftLeft<8>(half), mask);
    }
    alignas(64) uint32_t lows[16], highs[16];
    hn::Store(low_mask, bits, lows);
    hn::Store(high_mask, bits, highs);
    for (size_t k = 0; k < kLanes; ++k) masks[i + k] = lows[k] | (static_cast<uint64_t>(highs[k]) << 32);
  }
}

/// Calls f(cell) for every set bit, lowest first.
template <class F>
HWY_INLINE void for_each_cell(uint64_t mask, F&& f) {
  for (; mask != 0; mask &= mask - 1) f(hwy::Num0BitsBelowLS1Bit_Nonzero64(mask));
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
