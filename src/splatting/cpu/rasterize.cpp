// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/rasterize.h"

#include <algorithm>

#include "splatting/cpu/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/cpu/rasterize.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "splatting/cpu/cells-inl.h"
#include "splatting/cpu/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

/// State of a tile's pixels, cell after cell. A finished pixel (the next splat would bring its transmittance to 1e-4
/// or below) keeps its transmittance with the sign changed.
struct TileState {
  alignas(64) float transmittance[kTilePixels];
  alignas(64) float rgb[3][kTilePixels];
  alignas(64) float depth[kTilePixels];
  uint64_t active;  ///< Cells with an unfinished pixel.
};

void begin_tile(int columns, int rows, TileState& state) {
  std::fill_n(state.rgb[0], 3 * kTilePixels, 0.0f);
  std::fill_n(state.depth, kTilePixels, 0.0f);
  state.active = 0;
  for (int cell = 0; cell < 64; ++cell)
    for (int i = 0; i < kCellPixels; ++i) {
      const int x = (cell % kCellsPerRow) * kCellSize + i % kCellSize;
      const int y = (cell / kCellsPerRow) * kCellSize + i / kCellSize;
      const bool inside = x < columns && y < rows;
      state.transmittance[cell * kCellPixels + i] = inside ? 1.0f : -1.0f;
      if (inside) state.active |= uint64_t{1} << cell;
    }
}

/// Blends one splat into one cell; false when it changed nothing.
HWY_INLINE bool blend_cell(const Splat& splat, const SplatLanes& lanes, float u, float v, int cell, TileState& state) {
  const Vec cut = hn::Set(kFloats, -kLog2Cut), minimum = hn::Set(kFloats, kMinTransmittance);
  const Vec zero = hn::Zero(kFloats);
  bool used = false, finished = false;
  for (size_t part = 0; part < kVectorsPerCell; ++part) {
    const size_t at = static_cast<size_t>(cell) * kCellPixels + part * kLanes;
    const Coverage c =
        cover(lanes, hn::Load(kFloats, kCellX + part * kLanes), hn::Load(kFloats, kCellY + part * kLanes), u, v);
    const Vec alpha = hn::Min(exp2_fast(c.log2_alpha), hn::Set(kFloats, kMaxAlpha));
    const Vec before = hn::Load(kFloats, state.transmittance + at);
    const Vec after = hn::NegMulAdd(alpha, before, before);
    const Mask hit = hn::And(hn::Ge(c.log2_alpha, cut), hn::Gt(after, zero));
    if (hn::AllFalse(kFloats, hit)) continue;
    used = true;
    const Mask blend = hn::And(hit, hn::Gt(after, minimum));
    const Vec weight = hn::IfThenElseZero(blend, hn::Mul(alpha, before));
    for (int k = 0; k < 3; ++k) {
      float* sum = state.rgb[k] + at;
      hn::Store(hn::MulAdd(weight, hn::Set(kFloats, splat.rgb[k]), hn::Load(kFloats, sum)), kFloats, sum);
    }
    float* depth = state.depth + at;
    hn::Store(hn::MulAdd(weight, hn::Set(kFloats, splat.z), hn::Load(kFloats, depth)), kFloats, depth);
    Vec transmittance = hn::IfThenElse(blend, after, before);
    const Mask stop = hn::AndNot(blend, hit);
    if (HWY_UNLIKELY(!hn::AllFalse(kFloats, stop))) {
      transmittance = hn::IfThenElse(stop, hn::Neg(transmittance), transmittance);
      finished = true;
    }
    hn::Store(transmittance, kFloats, state.transmittance + at);
  }
  if (HWY_UNLIKELY(finished)) {
    bool any = false;
    for (size_t part = 0; part < kVectorsPerCell; ++part)
      any |= !hn::AllFalse(
          kFloats,
          hn::Gt(hn::Load(kFloats, state.transmittance + static_cast<size_t>(cell) * kCellPixels + part * kLanes),
                 zero));
    if (!any) state.active &= ~(uint64_t{1} << cell);
  }
  return used;
}

void end_tile(const Frame& frame, int x0, int y0, const TileState& state, RenderResult& result) {
  const int columns = std::min(kTileSize, frame.width - x0), rows = std::min(kTileSize, frame.height - y0);
  const size_t plane = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  for (int y = 0; y < rows; ++y) {
    const size_t out = static_cast<size_t>(y0 + y) * static_cast<size_t>(frame.width) + static_cast<size_t>(x0);
    for (int x = 0; x < columns; ++x) {
      const int cell = (y / kCellSize) * kCellsPerRow + x / kCellSize;
      const int at = cell * kCellPixels + (y % kCellSize) * kCellSize + x % kCellSize;
      const float transmittance = std::abs(state.transmittance[at]);
      const size_t pixel = out + static_cast<size_t>(x);
      for (size_t k = 0; k < 3; ++k)
        result.rgb[k * plane + pixel] = state.rgb[k][at] + transmittance * frame.background[k];
      result.depth[pixel] = state.depth[at];
      result.alpha[pixel] = 1.0f - transmittance;
    }
  }
}

void rasterize_tile(Frame& frame, int tile, RenderResult& result) {
  const int x0 = (tile % frame.tiles_x) * kTileSize, y0 = (tile / frame.tiles_x) * kTileSize;
  TileState state;
  begin_tile(std::min(kTileSize, frame.width - x0), std::min(kTileSize, frame.height - y0), state);
  const uint32_t begin = frame.tile_begin[static_cast<size_t>(tile)];
  const uint32_t end = frame.tile_begin[static_cast<size_t>(tile) + 1];
  uint32_t i = begin;
  for (; i < end && state.active != 0; ++i) {
    if (i + kPrefetchAhead < end) __builtin_prefetch(&frame.splats[frame.entries[i + kPrefetchAhead].slot]);
    const Splat& splat = frame.splats[frame.entries[i].slot];
    const float u = splat.u - static_cast<float>(x0), v = splat.v - static_cast<float>(y0);
    const SplatLanes lanes(splat);
    uint64_t used = 0;
    for (uint64_t cells = touched_cells(splat, u, v) & state.active; cells != 0; cells &= cells - 1) {
      const int cell = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero64(cells));
      const float cell_u = u - static_cast<float>((cell % kCellsPerRow) * kCellSize);
      const float cell_v = v - static_cast<float>((cell / kCellsPerRow) * kCellSize);
      if (blend_cell(splat, lanes, cell_u, cell_v, cell, state)) used |= uint64_t{1} << cell;
    }
    frame.cell_masks[i] = used;
  }
  std::fill(frame.cell_masks.data() + i, frame.cell_masks.data() + end, 0);
  end_tile(frame, x0, y0, state, result);
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::splatting {

HWY_EXPORT(rasterize_tile);

void rasterize(Executor& executor, Frame& frame, RenderResult& result) {
  const size_t plane = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  result.width = frame.width;
  result.height = frame.height;
  result.rgb.resize(3 * plane);
  result.depth.resize(plane);
  result.alpha.resize(plane);
  result.visible = frame.num_visible;
  executor.for_each(frame.num_tiles(),
                    [&](int tile, int) { HWY_DYNAMIC_DISPATCH(rasterize_tile)(frame, tile, result); });
}

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
