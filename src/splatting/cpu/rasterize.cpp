// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/rasterize.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "splatting/cpu/sort.h"
#include "splatting/cpu/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/cpu/rasterize.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "splatting/cpu/cells-inl.h"
#include "splatting/cpu/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

/// State of a cell's pixels. `running` is the product of all 1 − alpha so far; blending stops before it reaches 1e-4,
/// and since it only falls, comparing it is enough to know. `transmittance` is what was left when blending stopped.
struct alignas(64) CellState {
  float running[kCellPixels];
  float transmittance[kCellPixels];
  float rgb[3][kCellPixels];
  float depth[kCellPixels];
};

using TileState = CellState[64];

void begin_tile(int columns, int rows, TileState& state) {
  for (int cell = 0; cell < 64; ++cell) {
    state[cell] = CellState{};
    const int x = (cell % kCellsPerRow) * kCellSize, y = (cell / kCellsPerRow) * kCellSize;
    for (int i = 0; i < kCellPixels; ++i) {
      state[cell].running[i] = x + i % kCellSize < columns && y + i / kCellSize < rows ? 1.0f : 0.0f;
      state[cell].transmittance[i] = 1.0f;
    }
  }
}

/// Can the next splats still change a pixel of this cell?
HWY_INLINE bool is_active(const CellState& cell) {
  Vec best = hn::Load(kFloats, cell.running);
  for (size_t part = 1; part < kVectorsPerCell; ++part)
    best = hn::Max(best, hn::Load(kFloats, cell.running + part * kLanes));
  return !hn::AllFalse(kFloats, hn::Gt(best, hn::Set(kFloats, kMinTransmittance)));
}

uint64_t active_cells(const TileState& state) {
  uint64_t active = 0;
  for (size_t cell = 0; cell < 64; ++cell) active |= static_cast<uint64_t>(is_active(state[cell])) << cell;
  return active;
}

/// Blends the splats of a batch whose bits are set into a cell. A group is filled up with batch[kBatchSize], which is
/// invisible. Returns the bits of those that cover one of its pixels.
HWY_INLINE uint64_t blend_cell(const Splat* batch, uint64_t entries, size_t cell, CellState& c) {
  uint8_t list[kBatchSize + kGroupVectors];
  size_t count = 0;
  for (; entries != 0; entries &= entries - 1)
    list[count++] = static_cast<uint8_t>(hwy::Num0BitsBelowLS1Bit_Nonzero64(entries));
  std::fill_n(list + count, kGroupVectors, static_cast<uint8_t>(kBatchSize));
  uint64_t covering = 0;
  for (size_t part = 0; part < kVectorsPerCell; ++part) {
    const size_t at = part * kLanes;
    const Vec x = cell_x(cell, part), y = cell_y(cell, part);
    Vec running = hn::Load(kFloats, c.running + at), left = hn::Load(kFloats, c.transmittance + at);
    Vec red = hn::Load(kFloats, c.rgb[0] + at), green = hn::Load(kFloats, c.rgb[1] + at);
    Vec blue = hn::Load(kFloats, c.rgb[2] + at), depth = hn::Load(kFloats, c.depth + at);
    for (size_t i = 0; i < count; i += kGroupVectors) {
      const Splat* splats[kGroupVectors];
      Vec t[kGroupVectors], dy[kGroupVectors], alpha[kGroupVectors];
      for (size_t k = 0; k < kGroupVectors; ++k) splats[k] = batch + list[i + k];
      for (size_t k = 0; k < kGroupVectors; ++k) locate(*splats[k], x, y, t[k], dy[k]);
      const GroupMasks hits = alpha_group(splats, t, dy, alpha);
      for (size_t k = 0; k < kGroupVectors; ++k) {
        covering |= static_cast<uint64_t>(!hn::AllFalse(kFloats, hits.masks[k])) << (list[i + k] % 64);
        const Vec clamped = hn::Min(alpha[k], hn::Set(kFloats, kMaxAlpha));
        const Vec after = hn::NegMulAdd(clamped, running, running);
        const Mask blends = hn::Gt(after, hn::Set(kFloats, kMinTransmittance));
        const Vec weight = hn::IfThenElseZero(blends, hn::Mul(clamped, running));
        red = hn::MulAdd(weight, hn::Set(kFloats, splats[k]->rgb[0]), red);
        green = hn::MulAdd(weight, hn::Set(kFloats, splats[k]->rgb[1]), green);
        blue = hn::MulAdd(weight, hn::Set(kFloats, splats[k]->rgb[2]), blue);
        depth = hn::MulAdd(weight, hn::Set(kFloats, splats[k]->z), depth);
        left = hn::IfThenElse(blends, after, left);
        running = after;
      }
    }
    hn::Store(running, kFloats, c.running + at);
    hn::Store(left, kFloats, c.transmittance + at);
    hn::Store(red, kFloats, c.rgb[0] + at);
    hn::Store(green, kFloats, c.rgb[1] + at);
    hn::Store(blue, kFloats, c.rgb[2] + at);
    hn::Store(depth, kFloats, c.depth + at);
  }
  return covering;
}

/// Copies `count` <= 4 pixels of row `row` of a cell into the image planes.
HWY_INLINE void write_pixels(const CellState& cell, int row, int count, const float* background, size_t plane,
                             size_t pixel, RenderResult& result) {
  const int from = row * kCellSize;
  float transmittance[kCellSize], values[5][kCellSize];
  for (int i = 0; i < kCellSize; ++i) transmittance[i] = cell.transmittance[from + i];
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < kCellSize; ++i) values[k][i] = cell.rgb[k][from + i] + transmittance[i] * background[k];
  for (int i = 0; i < kCellSize; ++i) values[3][i] = cell.depth[from + i];
  for (int i = 0; i < kCellSize; ++i) values[4][i] = 1.0f - transmittance[i];
  float* const outputs[5] = {&result.rgb[pixel], &result.rgb[plane + pixel], &result.rgb[2 * plane + pixel],
                             &result.depth[pixel], &result.alpha[pixel]};
  for (int k = 0; k < 5; ++k) {
    if (count == kCellSize)
      std::memcpy(outputs[k], values[k], sizeof(values[k]));
    else
      std::copy_n(values[k], count, outputs[k]);
  }
}

void end_tile(const Frame& frame, int x0, int y0, const TileState& state, RenderResult& result) {
  const int columns = std::min(kTileSize, frame.width - x0), rows = std::min(kTileSize, frame.height - y0);
  const size_t plane = static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
  for (int y = 0; y < rows; ++y) {
    const size_t out = static_cast<size_t>(y0 + y) * static_cast<size_t>(frame.width) + static_cast<size_t>(x0);
    for (int x = 0; x < columns; x += kCellSize)
      write_pixels(state[(y / kCellSize) * kCellsPerRow + x / kCellSize], y % kCellSize,
                   std::min(kCellSize, columns - x), frame.background, plane, out + static_cast<size_t>(x), result);
  }
}

void rasterize_tile(Frame& frame, int tile, RenderResult& result) {
  const int x0 = (tile % frame.tiles_x) * kTileSize, y0 = (tile / frame.tiles_x) * kTileSize;
  TileState state;
  begin_tile(std::min(kTileSize, frame.width - x0), std::min(kTileSize, frame.height - y0), state);
  const uint32_t end = frame.tile_begin[static_cast<size_t>(tile) + 1];
  uint32_t begin = frame.tile_begin[static_cast<size_t>(tile)];
  Splat batch[kBatchSize + 1];
  batch[kBatchSize] = Splat{};
  batch[kBatchSize].log2_opacity = -100.0f;
  while (begin < end) {
    const uint64_t active = active_cells(state);
    if (active == 0) break;
    const size_t count = std::min<size_t>(kBatchSize, end - begin);
    gather_batch(frame, begin, count, end, x0, y0, batch);
    alignas(64) uint64_t masks[64] = {};
    touched_cells(batch, count, masks);
    std::fill(masks + count, masks + 64, 0);
    transpose_bits(masks);  // cells of an entry → entries of a cell
    for (size_t cell = 0; cell < 64; ++cell)
      masks[cell] =
          ((active >> cell) & 1) != 0 && masks[cell] != 0 ? blend_cell(batch, masks[cell], cell, state[cell]) : 0;
    transpose_bits(masks);
    std::copy_n(masks, count, frame.cell_masks.data() + begin);
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
  resize(result, {.width = frame.width, .height = frame.height});
  result.visible = frame.num_visible;
  frame.sorters.resize(static_cast<size_t>(executor.concurrency()));
  executor.for_each(frame.num_tiles(), [&](int tile, int worker) {
    sort_tile(frame, tile, frame.sorters[static_cast<size_t>(worker)]);
    HWY_DYNAMIC_DISPATCH(rasterize_tile)(frame, tile, result);
  });
}

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
