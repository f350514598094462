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

/// Entries to look ahead when prefetching: the records come from anywhere in L2 or L3.
inline constexpr uint32_t kPrefetchAhead = 12;

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

/// `x`, `y`: pixel coordinates of the lanes relative to the cell's corner; (u, v): the splat relative to the same.
HWY_INLINE Coverage cover(const SplatLanes& s, Vec x, Vec y, float u, float v) {
  Coverage c;
  const Vec dx = hn::Sub(x, hn::Set(kFloats, u));
  c.dy = hn::Sub(y, hn::Set(kFloats, v));
  c.t = hn::NegMulAdd(s.slope, c.dy, dx);
  const Vec inner = hn::MulAdd(hn::Mul(c.dy, c.dy), s.kc, s.log2_opacity);
  c.log2_alpha = hn::MulAdd(hn::Mul(c.t, c.t), s.ka, inner);
  return c;
}

/// The cells of a tile that hold a pixel centre inside the splat's cut ellipse, as bits 8 row + column. Exact up to
/// rounding, and never too small by more than that. (u, v): the splat relative to the tile's corner.
HWY_INLINE uint64_t touched_cells(const Splat& s, float u, float v) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  using V = hn::Vec<decltype(d)>;
  alignas(32) static constexpr float kRowTop[8] = {0, 4, 8, 12, 16, 20, 24, 28};
  alignas(32) int32_t first[8], last[8];
  const V extent_y = hn::Set(d, s.extent_y), minus_extent_y = hn::Set(d, -s.extent_y);
  const V cut = hn::Set(d, s.cut), kc = hn::Set(d, s.kc), inv_ka = hn::Set(d, s.inv_ka);
  const V slope = hn::Set(d, s.slope), peak = hn::Set(d, s.peak_dy), slack = hn::Set(d, 1e-3f);
  for (size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const V top = hn::Sub(hn::Load(d, kRowTop + i), hn::Set(d, v));
    const V low = hn::Max(top, minus_extent_y);
    const V high = hn::Min(hn::Add(top, hn::Set(d, 3.0f)), extent_y);
    const V dy_right = hn::Min(hn::Max(peak, low), high);
    const V dy_left = hn::Min(hn::Max(hn::Neg(peak), low), high);
    const auto half_width = [&](V dy) {
      const V square = hn::Mul(hn::MulAdd(hn::Mul(dy, dy), kc, cut), inv_ka);
      return hn::Add(hn::Sqrt(hn::Max(square, hn::Zero(d))), slack);
    };
    const V right = hn::Add(hn::MulAdd(slope, dy_right, hn::Set(d, u)), half_width(dy_right));
    const V left = hn::Sub(hn::MulAdd(slope, dy_left, hn::Set(d, u)), half_width(dy_left));
    // Cell c spans the centres 4c … 4c+3. Clamped before conversion: splats may be far away.
    const V quarter = hn::Set(d, 0.25f);
    const V from = hn::Ceil(hn::Mul(hn::Sub(left, hn::Set(d, 3.0f)), quarter));
    const V to = hn::Floor(hn::Mul(right, quarter));
    const V to_or_none = hn::IfThenElse(hn::Le(low, high), to, hn::Set(d, -1.0f));
    hn::Store(hn::ConvertTo(di, hn::Min(hn::Max(from, hn::Zero(d)), hn::Set(d, 8.0f))), di, first + i);
    hn::Store(hn::ConvertTo(di, hn::Min(hn::Max(to_or_none, hn::Set(d, -1.0f)), hn::Set(d, 7.0f))), di, last + i);
  }
  uint64_t mask = 0;
  for (int row = 0; row < 8; ++row) {
    const uint32_t bits = (0xFFu << first[row]) & (0xFFu >> (7 - last[row]));
    mask |= static_cast<uint64_t>(bits & 0xFFu) << (8 * row);
  }
  return mask;
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
