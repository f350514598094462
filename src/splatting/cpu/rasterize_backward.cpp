// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

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

/// Gradient records to fetch ahead of writing them.
inline constexpr uint32_t kRecordsAhead = 12;

/// What a tile's pixels carry along, cell after cell. `behind` is Σ over the splats still to come of weight times
/// (gradient · value), the background included: with it one number per pixel replaces the colours behind.
struct TileGradientState {
  alignas(64) float transmittance[kTilePixels];  ///< Sign as in the forward pass.
  alignas(64) float behind[kTilePixels];
  alignas(64) float rgb[3][kTilePixels];  ///< dL/d(colour of the pixel)
  alignas(64) float depth[kTilePixels];   ///< dL/d(depth of the pixel)
};

void begin_gradient_tile(const Frame& frame, int x0, int y0, const RenderResult& image, const ImageGradient& gradient,
                         TileGradientState& state) {
  const int columns = std::min(kTileSize, frame.width - x0), rows = std::min(kTileSize, frame.height - y0);
  const size_t plane = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  if (columns < kTileSize || rows < kTileSize) {
    std::fill_n(state.transmittance, kTilePixels, -1.0f);
    std::fill_n(state.behind, kTilePixels, 0.0f);
    std::fill_n(state.rgb[0], 3 * kTilePixels, 0.0f);
    std::fill_n(state.depth, kTilePixels, 0.0f);
  }
  for (int y = 0; y < rows; ++y) {
    const size_t in = static_cast<size_t>(y0 + y) * static_cast<size_t>(frame.width) + static_cast<size_t>(x0);
    for (int x = 0; x < columns; x += kCellSize) {
      const int cell = (y / kCellSize) * kCellsPerRow + x / kCellSize;
      const int first = cell * kCellPixels + (y % kCellSize) * kCellSize;
      const int count = std::min(kCellSize, columns - x);
      for (int i = 0; i < count; ++i) {
        const int at = first + i;
        const size_t pixel = in + static_cast<size_t>(x + i);
        float behind = 0;
        for (size_t k = 0; k < 3; ++k) {
          const float g = gradient.rgb[k * plane + pixel];
          state.rgb[k][at] = g;
          behind += g * image.rgb[k * plane + pixel];
        }
        const float depth = gradient.depth.empty() ? 0.0f : gradient.depth[pixel];
        behind += depth * image.depth[pixel];
        if (!gradient.alpha.empty()) behind -= gradient.alpha[pixel] * (1.0f - image.alpha[pixel]);
        state.depth[at] = depth;
        state.behind[at] = behind;
        state.transmittance[at] = 1.0f;
      }
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

template <bool kDepth>
HWY_INLINE void unblend_cell(const LocalSplat& local, const SplatLanes& lanes, size_t cell, TileGradientState& state,
                             RecordLanes& sums) {
  const Splat& splat = local.splat;
  const Vec one = hn::Set(kFloats, 1.0f), max_alpha = hn::Set(kFloats, kMaxAlpha);
  for (size_t part = 0; part < kVectorsPerCell; ++part) {
    const size_t at = cell * kCellPixels + part * kLanes;
    const Coverage c = cover(local, lanes, cell % kCellsPerRow, cell / kCellsPerRow, part);
    const Mask hit = hn::Ge(c.log2_alpha, hn::Set(kFloats, -kLog2Cut));
    const Vec raw = hn::IfThenElseZero(hit, exp2_fast(c.log2_alpha));
    const Vec alpha = hn::Min(raw, max_alpha);
    const Vec before = hn::Load(kFloats, state.transmittance + at);
    const Vec after = hn::NegMulAdd(alpha, before, before);
    const Mask blend = hn::Gt(after, hn::Set(kFloats, kMinTransmittance));
    const Vec weight = hn::IfThenElseZero(blend, hn::Mul(alpha, before));
    const Vec gr = hn::Load(kFloats, state.rgb[0] + at), gg = hn::Load(kFloats, state.rgb[1] + at);
    const Vec gb = hn::Load(kFloats, state.rgb[2] + at);
    Vec value = hn::Mul(gr, hn::Set(kFloats, splat.rgb[0]));
    value = hn::MulAdd(gg, hn::Set(kFloats, splat.rgb[1]), value);
    value = hn::MulAdd(gb, hn::Set(kFloats, splat.rgb[2]), value);
    if constexpr (kDepth) {
      const Vec gz = hn::Load(kFloats, state.depth + at);
      value = hn::MulAdd(gz, hn::Set(kFloats, splat.z), value);
      sums.z = hn::MulAdd(weight, gz, sums.z);
    }
    const Vec behind = hn::NegMulAdd(weight, value, hn::Load(kFloats, state.behind + at));
    hn::Store(behind, kFloats, state.behind + at);
    // dL/d(ln alpha) = weight value − behind alpha / (1 − alpha), with alpha > 0 and unclamped only.
    const Vec odds = hn::Mul(alpha, reciprocal(hn::Sub(one, alpha)));
    const Mask moves = hn::And(blend, hn::Le(raw, max_alpha));
    const Vec h = hn::IfThenElseZero(moves, hn::NegMulAdd(behind, odds, hn::Mul(weight, value)));
    const Vec h_t = hn::Mul(h, c.t), h_dy = hn::Mul(h, c.dy);
    sums.t = hn::Add(sums.t, h_t);
    sums.dy = hn::Add(sums.dy, h_dy);
    sums.tt = hn::MulAdd(h_t, c.t, sums.tt);
    sums.t_dy = hn::MulAdd(h_t, c.dy, sums.t_dy);
    sums.dy_dy = hn::MulAdd(h_dy, c.dy, sums.dy_dy);
    sums.one = hn::Add(sums.one, h);
    sums.r = hn::MulAdd(weight, gr, sums.r);
    sums.g = hn::MulAdd(weight, gg, sums.g);
    sums.b = hn::MulAdd(weight, gb, sums.b);
    sums.weight = hn::Add(sums.weight, weight);
    sums.max_weight = hn::Max(sums.max_weight, weight);
    const Vec finished = hn::Or(before, hn::Set(kFloats, -0.0f));
    hn::Store(hn::IfThenElse(blend, after, finished), kFloats, state.transmittance + at);
  }
}

template <bool kDepth>
HWY_INLINE void unblend_entries(Frame& frame, uint32_t begin, uint32_t end, int x0, int y0, TileGradientState& state) {
  alignas(64) LocalSplat batch[kBatchSize];
  while (begin < end) {
    const size_t count = std::min<size_t>(kBatchSize, end - begin);
    gather_batch(frame, begin, count, end, x0, y0, batch);
    for (size_t i = 0; i < count; ++i) {
      const uint32_t instance = frame.entries[begin + i].instance;
      if (begin + i + kRecordsAhead < end)
        __builtin_prefetch(&frame.gradients[frame.entries[begin + i + kRecordsAhead].instance], 1);
      const SplatLanes lanes(batch[i].splat);
      RecordLanes sums;
      for_each_cell(frame.cell_masks[begin + i],
                    [&](size_t cell) HWY_ATTR { unblend_cell<kDepth>(batch[i], lanes, cell, state, sums); });
      sums.reduce(frame.gradients[instance]);
    }
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
