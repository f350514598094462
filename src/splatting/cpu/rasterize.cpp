// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/rasterize.h"

#include <algorithm>
#include <cmath>

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
};

void begin_tile(int columns, int rows, TileState& state) {
  std::fill_n(state.rgb[0], 3 * kTilePixels, 0.0f);
  std::fill_n(state.depth, kTilePixels, 0.0f);
  std::fill_n(state.transmittance, kTilePixels, 1.0f);
  if (columns == kTileSize && rows == kTileSize) return;
  for (int at = 0; at < kTilePixels; ++at) {
    const int cell = at / kCellPixels, i = at % kCellPixels;
    const int x = (cell % kCellsPerRow) * kCellSize + i % kCellSize;
    const int y = (cell / kCellsPerRow) * kCellSize + i / kCellSize;
    if (x >= columns || y >= rows) state.transmittance[at] = -1.0f;
  }
}

/// Cells with an unfinished pixel.
uint64_t active_cells(const TileState& state) {
  uint64_t active = 0;
  for (size_t cell = 0; cell < 64; ++cell) {
    Vec best = hn::Load(kFloats, state.transmittance + cell * kCellPixels);
    for (size_t part = 1; part < kVectorsPerCell; ++part)
      best = hn::Max(best, hn::Load(kFloats, state.transmittance + cell * kCellPixels + part * kLanes));
    const uint64_t any = hn::AllFalse(kFloats, hn::Gt(best, hn::Zero(kFloats))) ? 0 : 1;
    active |= any << cell;
  }
  return active;
}

/// Blends one splat into one cell, without branches; returns whether it covers any of its pixels.
HWY_INLINE bool blend_cell(const LocalSplat& local, const SplatLanes& lanes, size_t cell, TileState& state) {
  bool covers = false;
  for (size_t part = 0; part < kVectorsPerCell; ++part) {
    const size_t at = cell * kCellPixels + part * kLanes;
    const Coverage c = cover(local, lanes, cell % kCellsPerRow, cell / kCellsPerRow, part);
    const Mask hit = hn::Ge(c.log2_alpha, hn::Set(kFloats, -kLog2Cut));
    covers |= !hn::AllFalse(kFloats, hit);
    const Vec alpha = hn::IfThenElseZero(hit, hn::Min(exp2_fast(c.log2_alpha), hn::Set(kFloats, kMaxAlpha)));
    const Vec before = hn::Load(kFloats, state.transmittance + at);
    const Vec after = hn::NegMulAdd(alpha, before, before);
    const Mask blend = hn::Gt(after, hn::Set(kFloats, kMinTransmittance));  // false where finished before
    const Vec weight = hn::IfThenElseZero(blend, hn::Mul(alpha, before));
    for (int k = 0; k < 3; ++k) {
      float* sum = state.rgb[k] + at;
      hn::Store(hn::MulAdd(weight, hn::Set(kFloats, local.splat.rgb[k]), hn::Load(kFloats, sum)), kFloats, sum);
    }
    float* depth = state.depth + at;
    hn::Store(hn::MulAdd(weight, hn::Set(kFloats, local.splat.z), hn::Load(kFloats, depth)), kFloats, depth);
    const Vec finished = hn::Or(before, hn::Set(kFloats, -0.0f));
    hn::Store(hn::IfThenElse(blend, after, finished), kFloats, state.transmittance + at);
  }
  return covers;
}

void end_tile(const Frame& frame, int x0, int y0, const TileState& state, RenderResult& result) {
  const int columns = std::min(kTileSize, frame.width - x0), rows = std::min(kTileSize, frame.height - y0);
  const size_t plane = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  for (int y = 0; y < rows; ++y) {
    const size_t out = static_cast<size_t>(y0 + y) * static_cast<size_t>(frame.width) + static_cast<size_t>(x0);
    for (int x = 0; x < columns; x += kCellSize) {
      const int cell = (y / kCellSize) * kCellsPerRow + x / kCellSize;
      const int at = cell * kCellPixels + (y % kCellSize) * kCellSize;
      const size_t pixel = out + static_cast<size_t>(x);
      const int count = std::min(kCellSize, columns - x);
      for (int i = 0; i < count; ++i) {
        const float transmittance = std::abs(state.transmittance[at + i]);
        const size_t p = pixel + static_cast<size_t>(i);
        for (size_t k = 0; k < 3; ++k)
          result.rgb[k * plane + p] = state.rgb[k][at + i] + transmittance * frame.background[k];
        result.depth[p] = state.depth[at + i];
        result.alpha[p] = 1.0f - transmittance;
      }
    }
  }
}

void rasterize_tile(Frame& frame, int tile, RenderResult& result) {
  const int x0 = (tile % frame.tiles_x) * kTileSize, y0 = (tile / frame.tiles_x) * kTileSize;
  TileState state;
  begin_tile(std::min(kTileSize, frame.width - x0), std::min(kTileSize, frame.height - y0), state);
  const uint32_t end = frame.tile_begin[static_cast<size_t>(tile) + 1];
  uint32_t begin = frame.tile_begin[static_cast<size_t>(tile)];
  alignas(64) LocalSplat batch[kBatchSize];
  uint64_t masks[kBatchSize + 16];
  while (begin < end) {
    const uint64_t active = active_cells(state);
    if (active == 0) break;
    const size_t count = std::min<size_t>(kBatchSize, end - begin);
    gather_batch(frame, begin, count, end, x0, y0, batch);
    touched_cells(batch, count, masks);
    for (size_t i = 0; i < count; ++i) {
      const SplatLanes lanes(batch[i].splat);
      uint64_t used = 0;
      for_each_cell(masks[i] & active, [&](size_t cell) HWY_ATTR {
        used |= static_cast<uint64_t>(blend_cell(batch[i], lanes, cell, state)) << cell;
      });
      frame.cell_masks[begin + i] = used;
    }
    begin += static_cast<uint32_t>(count);
  }
  std::fill(frame.cell_masks.data() + begin, frame.cell_masks.data() + end, 0);
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
