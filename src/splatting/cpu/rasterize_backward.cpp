// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>

#include "splatting/cpu/rasterize.h"
#include "splatting/cpu/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/cpu/rasterize_backward.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "splatting/cpu/cells-inl.h"
#include "splatting/cpu/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

/// What a cell's pixels carry along. `behind` is Σ over the splats still to come of weight times (gradient · value),
/// the background included: with it one number per pixel replaces the colours behind.
struct alignas(64) CellGradientState {
  float running[kCellPixels];  ///< Product of all 1 − alpha so far, as in the forward pass.
  float behind[kCellPixels];
  float rgb[3][kCellPixels];  ///< dL/d(colour of the pixel)
};

/// Depths apart: without them what a tile needs stays in the first-level cache.
struct TileGradientState {
  CellGradientState cells[64];
  alignas(64) float depth[64][kCellPixels];  ///< dL/d(depth of the pixel)
};

/// Reads `count` <= 4 pixels of one row of a cell.
HWY_INLINE void read_pixels(const RenderResult& image, const ImageGradient& gradient, size_t plane, size_t pixel,
                            int count, int at, CellGradientState& cell, float* depth) {
  float behind[kCellSize] = {}, g[kCellSize], value[kCellSize];
  const auto add = [&](const float* gradients, const float* values, float* out) {
    if (count == kCellSize) {
      std::memcpy(g, gradients + pixel, sizeof(g));
      std::memcpy(value, values + pixel, sizeof(value));
      for (int i = 0; i < kCellSize; ++i) behind[i] += g[i] * value[i];
      std::memcpy(out + at, g, sizeof(g));
    } else {
      for (int i = 0; i < count; ++i)
        behind[i] += gradients[pixel + static_cast<size_t>(i)] * values[pixel + static_cast<size_t>(i)];
      std::copy_n(gradients + pixel, count, out + at);
    }
  };
  for (size_t k = 0; k < 3; ++k) add(&gradient.rgb[k * plane], &image.rgb[k * plane], cell.rgb[k]);
  if (!gradient.depth.empty()) add(gradient.depth.data(), image.depth.data(), depth);
  if (!gradient.alpha.empty())
    for (size_t i = 0; i < static_cast<size_t>(count); ++i)
      behind[i] -= gradient.alpha[pixel + i] * (1.0f - image.alpha[pixel + i]);
  std::copy_n(behind, count, cell.behind + at);
  std::fill_n(cell.running + at, count, 1.0f);
}

void begin_gradient_tile(const Frame& frame, int x0, int y0, const RenderResult& image, const ImageGradient& gradient,
                         TileGradientState& state) {
  const int columns = std::min(kTileSize, frame.width - x0), rows = std::min(kTileSize, frame.height - y0);
  const size_t plane = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  if (columns < kTileSize || rows < kTileSize) state = TileGradientState{};
  for (int y = 0; y < rows; ++y) {
    const size_t in = static_cast<size_t>(y0 + y) * static_cast<size_t>(frame.width) + static_cast<size_t>(x0);
    for (int x = 0; x < columns; x += kCellSize) {
      const int cell = y / kCellSize * kCellsPerRow + x / kCellSize;
      read_pixels(image, gradient, plane, in + static_cast<size_t>(x), std::min(kCellSize, columns - x),
                  y % kCellSize * kCellSize, state.cells[cell], state.depth[cell]);
    }
  }
}

/// Sums of each of four vectors, side by side: transposes within 128-bit blocks, then adds up the blocks.
HWY_INLINE void store_sums(Vec a, Vec b, Vec c, Vec d, float* out) {
  const hn::Repartition<double, Floats> doubles;
  const Vec ab = hn::Add(hn::InterleaveLower(kFloats, a, b), hn::InterleaveUpper(kFloats, a, b));
  const Vec cd = hn::Add(hn::InterleaveLower(kFloats, c, d), hn::InterleaveUpper(kFloats, c, d));
  const auto ab2 = hn::BitCast(doubles, ab), cd2 = hn::BitCast(doubles, cd);
  const Vec sums = hn::Add(hn::BitCast(kFloats, hn::InterleaveLower(doubles, ab2, cd2)),
                           hn::BitCast(kFloats, hn::InterleaveUpper(doubles, ab2, cd2)));
  const auto add_blocks = [](auto tag, auto v, auto& self) HWY_ATTR {
    if constexpr (hn::MaxLanes(tag) == 4) {
      return v;
    } else {
      const hn::Half<decltype(tag)> half;
      return self(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)), self);
    }
  };
  hn::Store(add_blocks(kFloats, sums, add_blocks), hn::FixedTag<float, 4>(), out);
}

/// Lane-wise sums of one gradient record.
struct RecordLanes {
  Vec t, dy, tt, t_dy, dy_dy, one, r, g, b, z, weight, max_weight;
  HWY_INLINE RecordLanes()
      : t(hn::Zero(kFloats)),
        dy(t),
        tt(t),
        t_dy(t),
        dy_dy(t),
        one(t),
        r(t),
        g(t),
        b(t),
        z(t),
        weight(t),
        max_weight(t) {}

  HWY_INLINE void reduce(SplatGradient& out) const {
    store_sums(t, dy, tt, t_dy, &out.t);
    store_sums(dy_dy, one, r, g, &out.dy_dy);
    store_sums(b, z, weight, weight, &out.rgb[2]);
    out.max_weight = hn::GetLane(hn::MaxOfLanes(kFloats, max_weight));
  }
};

inline constexpr size_t kMaxPairs = 64;  ///< At least the cells of a tile.
inline constexpr size_t kGroupCells = kGroupVectors / kVectorsPerCell;
static_assert(kGroupCells >= 1);

/// (splat, cell) pairs in blending order, and what can be known of them before blending.
struct Pairs {
  size_t count = 0;
  uint16_t items[kMaxPairs + kGroupCells];                           ///< 64 * index into the batch + cell.
  alignas(64) float alpha[(kMaxPairs + kGroupCells) * kCellPixels];  ///< Clamped.

  HWY_INLINE bool has_room(uint64_t mask) const { return count + hwy::PopCount(mask) <= kMaxPairs; }
  HWY_INLINE void append(size_t entry, uint64_t mask) {
    size_t n = count;
    for (; mask != 0; mask &= mask - 1)
      items[n++] = static_cast<uint16_t>(64 * entry + hwy::Num0BitsBelowLS1Bit_Nonzero64(mask));
    count = n;
  }
  size_t entry(size_t pair) const { return items[pair] / 64; }
  size_t cell(size_t pair) const { return items[pair] % 64; }
};

/// Fills in alpha of all pairs, in lockstep groups.
HWY_INLINE void cover_pairs(const Splat* batch, Pairs& pairs) {
  std::fill_n(pairs.items + pairs.count, kGroupCells, uint16_t{0});
  const Vec max_alpha = hn::Set(kFloats, kMaxAlpha);
  for (size_t i = 0; i < pairs.count; i += kGroupCells) {
    const Splat* splats[kGroupVectors];
    Vec t[kGroupVectors], dy[kGroupVectors], alpha[kGroupVectors];
    for (size_t k = 0; k < kGroupVectors; ++k) {
      const size_t pair = i + k / kVectorsPerCell, part = k % kVectorsPerCell, cell = pairs.cell(pair);
      splats[k] = &batch[pairs.entry(pair)];
      locate(*splats[k], cell_x(cell, part), cell_y(cell, part), t[k], dy[k]);
    }
    alpha_group(splats, t, dy, alpha);
    for (size_t k = 0; k < kGroupVectors; ++k)
      hn::Store(hn::Min(alpha[k], max_alpha), kFloats, pairs.alpha + i * kCellPixels + k * kLanes);
  }
}

template <bool kDepth>
HWY_INLINE void unblend(const Splat& splat, size_t cell, size_t part, Vec alpha, TileGradientState& tile,
                        RecordLanes& sums) {
  CellGradientState& state = tile.cells[cell];
  const size_t at = part * kLanes;
  const Vec before = hn::Load(kFloats, state.running + at);
  const Vec after = hn::NegMulAdd(alpha, before, before);
  const Mask blends = hn::Gt(after, hn::Set(kFloats, kMinTransmittance));
  const Vec weight = hn::IfThenElseZero(blends, hn::Mul(alpha, before));
  const Vec gr = hn::Load(kFloats, state.rgb[0] + at), gg = hn::Load(kFloats, state.rgb[1] + at);
  const Vec gb = hn::Load(kFloats, state.rgb[2] + at);
  Vec value = hn::Mul(gr, hn::Set(kFloats, splat.rgb[0]));
  value = hn::MulAdd(gg, hn::Set(kFloats, splat.rgb[1]), value);
  value = hn::MulAdd(gb, hn::Set(kFloats, splat.rgb[2]), value);
  if constexpr (kDepth) {
    const Vec gz = hn::Load(kFloats, tile.depth[cell] + at);
    value = hn::MulAdd(gz, hn::Set(kFloats, splat.z), value);
    sums.z = hn::MulAdd(weight, gz, sums.z);
  }
  const Vec behind = hn::NegMulAdd(weight, value, hn::Load(kFloats, state.behind + at));
  hn::Store(behind, kFloats, state.behind + at);
  // h = dL/d(ln alpha) = weight value − behind alpha / (1 − alpha); a clamped alpha does not follow its exponent.
  const Mask moves = hn::And(blends, hn::Lt(alpha, hn::Set(kFloats, kMaxAlpha)));
  const Vec odds = hn::Mul(alpha, reciprocal(hn::Sub(hn::Set(kFloats, 1.0f), alpha)));
  const Vec h = hn::IfThenElseZero(moves, hn::NegMulAdd(behind, odds, hn::Mul(weight, value)));
  Vec t, dy;
  locate(splat, cell_x(cell, part), cell_y(cell, part), t, dy);
  const Vec h_t = hn::Mul(h, t), h_dy = hn::Mul(h, dy);
  sums.t = hn::Add(sums.t, h_t);
  sums.dy = hn::Add(sums.dy, h_dy);
  sums.tt = hn::MulAdd(h_t, t, sums.tt);
  sums.t_dy = hn::MulAdd(h_t, dy, sums.t_dy);
  sums.dy_dy = hn::MulAdd(h_dy, dy, sums.dy_dy);
  sums.one = hn::Add(sums.one, h);
  sums.r = hn::MulAdd(weight, gr, sums.r);
  sums.g = hn::MulAdd(weight, gg, sums.g);
  sums.b = hn::MulAdd(weight, gb, sums.b);
  sums.weight = hn::Add(sums.weight, weight);
  sums.max_weight = hn::Max(sums.max_weight, weight);
  hn::Store(after, kFloats, state.running + at);
}

/// Entries [first, last) of a batch, whose pairs are listed: one gradient record each.
template <bool kDepth>
HWY_INLINE void unblend_pairs(Frame& frame, const TileEntry* entries, size_t first, size_t last, const Splat* batch,
                              Pairs& pairs, TileGradientState& state) {
  cover_pairs(batch, pairs);
  size_t pair = 0;
  for (size_t i = first; i < last; ++i) {
    RecordLanes sums;
    for (; pair < pairs.count && pairs.entry(pair) == i; ++pair)
      for (size_t part = 0; part < kVectorsPerCell; ++part) {
        const size_t at = pair * kCellPixels + part * kLanes;
        unblend<kDepth>(batch[i], pairs.cell(pair), part, hn::Load(kFloats, pairs.alpha + at), state, sums);
      }
    sums.reduce(frame.gradients[entries[i].instance]);
  }
  pairs.count = 0;
}

template <bool kDepth>
HWY_INLINE void unblend_entries(Frame& frame, uint32_t begin, uint32_t end, int x0, int y0, TileGradientState& state) {
  Splat batch[kBatchSize];
  Pairs pairs;
  while (begin < end) {
    const size_t count = std::min<size_t>(kBatchSize, end - begin);
    const TileEntry* entries = &frame.entries[begin];
    gather_batch(frame, begin, count, end, x0, y0, batch);
    size_t first = 0;
    for (size_t i = 0; i < count; ++i) {
      __builtin_prefetch(&frame.gradients[entries[i].instance], 1);
      const uint64_t mask = frame.cell_masks[begin + i];
      if (!pairs.has_room(mask)) {
        unblend_pairs<kDepth>(frame, entries, first, i, batch, pairs, state);
        first = i;
      }
      pairs.append(i, mask);
    }
    unblend_pairs<kDepth>(frame, entries, first, count, batch, pairs, state);
    begin += static_cast<uint32_t>(count);
  }
}

void unblend_tile(Frame& frame, int tile, const RenderResult& image, const ImageGradient& gradient) {
  const uint32_t begin = frame.tile_begin[static_cast<size_t>(tile)];
  const uint32_t end = frame.tile_begin[static_cast<size_t>(tile) + 1];
  if (begin == end) return;
  const int x0 = (tile % frame.tiles_x) * kTileSize, y0 = (tile / frame.tiles_x) * kTileSize;
  TileGradientState state;
  begin_gradient_tile(frame, x0, y0, image, gradient, state);
  if (gradient.depth.empty())
    unblend_entries<false>(frame, begin, end, x0, y0, state);
  else
    unblend_entries<true>(frame, begin, end, x0, y0, state);
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::splatting {

HWY_EXPORT(unblend_tile);

void rasterize_backward(Executor& executor, Frame& frame, const RenderResult& result, const ImageGradient& gradient) {
  frame.gradients.reserve(frame.num_instances);
  executor.for_each(frame.num_tiles(),
                    [&](int tile, int) { HWY_DYNAMIC_DISPATCH(unblend_tile)(frame, tile, result, gradient); });
}

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
