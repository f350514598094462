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
  const size_t plane = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  for (int at = 0; at < kTilePixels; ++at) {
    const int cell = at / kCellPixels, i = at % kCellPixels;
    const int x = x0 + (cell % kCellsPerRow) * kCellSize + i % kCellSize;
    const int y = y0 + (cell / kCellsPerRow) * kCellSize + i / kCellSize;
    const bool inside = x < frame.width && y < frame.height;
    state.transmittance[at] = inside ? 1.0f : -1.0f;
    const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(frame.width) + static_cast<size_t>(x);
    float behind = 0;
    for (size_t k = 0; k < 3; ++k) {
      const float g = inside ? gradient.rgb[k * plane + pixel] : 0.0f;
      state.rgb[k][at] = g;
      if (inside) behind += g * image.rgb[k * plane + pixel];
    }
    const float depth = inside && !gradient.depth.empty() ? gradient.depth[pixel] : 0.0f;
    state.depth[at] = depth;
    if (inside) behind += depth * image.depth[pixel];
    if (inside && !gradient.alpha.empty()) behind -= gradient.alpha[pixel] * (1.0f - image.alpha[pixel]);
    state.behind[at] = behind;
  }
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

  HWY_INLINE static float sum(Vec v) { return hn::GetLane(hn::SumOfLanes(kFloats, v)); }
  HWY_INLINE void reduce(SplatGradient& out) const {
    out.t = sum(t);
    out.dy = sum(dy);
    out.tt = sum(tt);
    out.t_dy = sum(t_dy);
    out.dy_dy = sum(dy_dy);
    out.one = sum(one);
    out.rgb[0] = sum(r);
    out.rgb[1] = sum(g);
    out.rgb[2] = sum(b);
    out.z = sum(z);
    out.weight = sum(weight);
    out.max_weight = hn::GetLane(hn::MaxOfLanes(kFloats, max_weight));
  }
};

template <bool kDepth>
HWY_INLINE void unblend_cell(const Splat& splat, const SplatLanes& lanes, float u, float v, int cell,
                             TileGradientState& state, RecordLanes& sums) {
  const Vec zero = hn::Zero(kFloats), one = hn::Set(kFloats, 1.0f), max_alpha = hn::Set(kFloats, kMaxAlpha);
  for (size_t part = 0; part < kVectorsPerCell; ++part) {
    const size_t at = static_cast<size_t>(cell) * kCellPixels + part * kLanes;
    const Coverage c =
        cover(lanes, hn::Load(kFloats, kCellX + part * kLanes), hn::Load(kFloats, kCellY + part * kLanes), u, v);
    const Vec raw = exp2_fast(c.log2_alpha);
    const Vec alpha = hn::Min(raw, max_alpha);
    const Vec before = hn::Load(kFloats, state.transmittance + at);
    const Vec after = hn::NegMulAdd(alpha, before, before);
    const Mask hit = hn::And(hn::Ge(c.log2_alpha, hn::Set(kFloats, -kLog2Cut)), hn::Gt(after, zero));
    const Mask blend = hn::And(hit, hn::Gt(after, hn::Set(kFloats, kMinTransmittance)));
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
    // dL/d(alpha) = T value − behind / (1 − alpha); a clamped alpha does not follow its exponent.
    const Vec d_alpha = hn::NegMulAdd(behind, reciprocal(hn::Sub(one, alpha)), hn::Mul(before, value));
    const Vec h = hn::IfThenElseZero(hn::And(blend, hn::Le(raw, max_alpha)), hn::Mul(alpha, d_alpha));
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
    Vec transmittance = hn::IfThenElse(blend, after, before);
    transmittance = hn::IfThenElse(hn::AndNot(blend, hit), hn::Neg(transmittance), transmittance);
    hn::Store(transmittance, kFloats, state.transmittance + at);
  }
}

template <bool kDepth>
HWY_INLINE void unblend_entries(Frame& frame, uint32_t begin, uint32_t end, int x0, int y0, TileGradientState& state) {
  for (uint32_t i = begin; i < end; ++i) {
    if (i + kPrefetchAhead < end) {
      const TileEntry next = frame.entries[i + kPrefetchAhead];
      __builtin_prefetch(&frame.splats[next.slot]);
      __builtin_prefetch(&frame.gradients[next.instance], 1);
    }
    const TileEntry entry = frame.entries[i];
    const Splat& splat = frame.splats[entry.slot];
    const float u = splat.u - static_cast<float>(x0), v = splat.v - static_cast<float>(y0);
    const SplatLanes lanes(splat);
    RecordLanes sums;
    for (uint64_t cells = frame.cell_masks[i]; cells != 0; cells &= cells - 1) {
      const int cell = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero64(cells));
      const float cell_u = u - static_cast<float>((cell % kCellsPerRow) * kCellSize);
      const float cell_v = v - static_cast<float>((cell / kCellsPerRow) * kCellSize);
      unblend_cell<kDepth>(splat, lanes, cell_u, cell_v, cell, state, sums);
    }
    sums.reduce(frame.gradients[entry.instance]);
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
