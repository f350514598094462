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

/// Pixel coordinates of the cells of a tile in the order of the lanes: x by the cell's column, y by its row.
struct CellCoordinates {
  alignas(64) float x[kCellsPerRow][kCellPixels];
  alignas(64) float y[kCellsPerRow][kCellPixels];
};
inline constexpr CellCoordinates kCells = [] {
  CellCoordinates c{};
  for (int cell = 0; cell < kCellsPerRow; ++cell)
    for (int i = 0; i < kCellPixels; ++i) {
      c.x[cell][i] = static_cast<float>(cell * kCellSize + i % kCellSize);
      const int row = i / kCellSize;
      c.y[cell][i] = static_cast<float>(cell * kCellSize + row);
    }
  return c;
}();
inline constexpr size_t kVectorsPerCell = kCellPixels / kLanes;

/// Entries blended between two looks at which cells are finished; their splats are copied to where they stay in L1.
inline constexpr size_t kBatchSize = 64;

/// Copies entries [begin, begin + count) of a tile with positions relative to the tile, and fetches the batch after
/// them into the caches.
HWY_INLINE void gather_batch(const Frame& frame, uint32_t begin, size_t count, uint32_t end, int x0, int y0,
                             Splat* batch) {
  const float left = static_cast<float>(x0), top = static_cast<float>(y0);
  for (size_t i = 0; i < count; ++i) {
    const uint32_t ahead = begin + static_cast<uint32_t>(i + kBatchSize);
    if (ahead < end) __builtin_prefetch(&frame.splats[frame.entries[ahead].slot]);
    batch[i] = frame.splats[frame.entries[begin + i].slot];
    batch[i].u -= left;
    batch[i].v -= top;
  }
}

/// Pixel coordinates of part `part` of a cell, relative to the tile.
HWY_INLINE Vec cell_x(size_t cell, size_t part) {
  return hn::Load(kFloats, kCells.x[cell % kCellsPerRow] + part * kLanes);
}
HWY_INLINE Vec cell_y(size_t cell, size_t part) {
  return hn::Load(kFloats, kCells.y[cell / kCellsPerRow] + part * kLanes);
}

/// For each splat of a batch, the cells that hold a pixel centre inside its cut ellipse, as bits 8 row + column; up to
/// a sliver more, never less. One splat per lane.
HWY_INLINE void touched_cells(const Splat* batch, size_t count, uint64_t* masks) {
  using Bits = hn::RebindToUnsigned<Floats>;
  constexpr Bits bits;
  enum Field { kU, kV, kSlope, kKc, kCut, kInvKa, kPeak, kExtent, kFields };
  alignas(64) float fields[kFields][kBatchSize];
  for (size_t i = 0; i < count; ++i) {
    const Splat& s = batch[i];
    const float values[kFields] = {s.u, s.v, s.slope, s.kc, s.cut, s.inv_ka, s.peak_dy, s.extent_y};
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

/// Vectors evaluated in lockstep.
inline constexpr size_t kGroupVectors = 4;

/// Where pixels (x, y) of a tile lie relative to a splat: t and dy of Splat.
HWY_INLINE void locate(const Splat& s, Vec x, Vec y, Vec& t, Vec& dy) {
  const Vec dx = hn::Sub(x, hn::Set(kFloats, s.u));
  dy = hn::Sub(y, hn::Set(kFloats, s.v));
  t = hn::NegMulAdd(hn::Set(kFloats, s.slope), dy, dx);
}

struct GroupMasks {
  Mask masks[kGroupVectors];
  // NOLINTNEXTLINE(modernize-use-equals-default): a defaulted one would not belong to the SIMD target
  HWY_INLINE GroupMasks() {}
};

/// Unclamped alpha from t and dy for four vectors in lockstep, zero below the cut-off; returns where it is not.
HWY_INLINE GroupMasks alpha_group(const Splat* const* splats, const Vec* t, const Vec* dy,
                                  Vec (&alpha)[kGroupVectors]) {
  Vec log2_alpha[kGroupVectors];
  for (size_t k = 0; k < kGroupVectors; ++k) {
    const Splat& s = *splats[k];
    const Vec inner = hn::MulAdd(hn::Mul(dy[k], dy[k]), hn::Set(kFloats, s.kc), hn::Set(kFloats, s.log2_opacity));
    log2_alpha[k] = hn::MulAdd(hn::Mul(t[k], t[k]), hn::Set(kFloats, s.ka), inner);
    alpha[k] = log2_alpha[k];
  }
  exp2_fast(alpha);
  GroupMasks hits;
  for (size_t k = 0; k < kGroupVectors; ++k) {
    hits.masks[k] = hn::Ge(log2_alpha[k], hn::Set(kFloats, -kLog2Cut));
    alpha[k] = hn::IfThenElseZero(hits.masks[k], alpha[k]);
  }
  return hits;
}

/// Transposes a 64x64 matrix of bits: bit c of word r becomes bit r of word c.
HWY_INLINE void transpose_bits(uint64_t* words) {
  uint64_t low = 0x00000000FFFFFFFFull;
  for (size_t half = 32; half != 0; half /= 2, low ^= low << half)
    for (size_t base = 0; base < 64; base += 2 * half)
      for (size_t i = base; i < base + half; ++i) {
        const uint64_t swap = ((words[i] >> half) ^ words[i + half]) & low;
        words[i] ^= swap << half;
        words[i + half] ^= swap;
      }
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
