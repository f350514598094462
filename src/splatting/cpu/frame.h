// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "splatting/anchor_view.h"
#include "splatting/blending.h"
#include "splatting/cpu/buffer.h"
#include "splatting/model.h"
#include "splatting/view.h"

namespace photoslam::splatting {

inline constexpr int kTileSize = 32;  ///< Pixels per side; a tile is one task.
inline constexpr int kTilePixels = kTileSize * kTileSize;
inline constexpr int kCellSize = 4;  ///< 4x4 pixels: the unit that is skipped or blended.
inline constexpr int kCellPixels = kCellSize * kCellSize;
inline constexpr int kCellsPerRow = kTileSize / kCellSize;  ///< 8x8 cells: one bit each in a 64-bit mask.
inline constexpr int kBlocksPerTask = 8;                    ///< Gaussian blocks projected or updated by one task.

/// A projected gaussian: one cache line. With t = dx − slope dy, (dx, dy) = pixel − (u, v):
/// log2(alpha) = log2_opacity + ka t² + kc dy².
struct alignas(64) Splat {
  float u, v;
  float slope;   ///< Covariance b/c.
  float ka, kc;  ///< −½ log2(e) c/det and −½ log2(e) / c.
  float log2_opacity;
  float rgb[3];
  float z;
  float cut;                 ///< log2(255 opacity) > 0: how far log2(alpha) may fall.
  float inv_ka;              ///< −1/ka.
  float peak_dy;             ///< dy of the point of the cut ellipse with the largest dx.
  float extent_x, extent_y;  ///< Half size of the cut ellipse's box [px].
  float unused;
};
static_assert(sizeof(Splat) == 64);

/// Sums over the pixels of one tile, h = dL/d(ln alpha): the gradient record of one (gaussian, tile).
struct alignas(64) SplatGradient {
  float t, dy, tt, t_dy, dy_dy, one;  ///< Σ h {t, dy, t², t dy, dy², 1}
  float rgb[3];                       ///< dL/d(colour)
  float z;                            ///< dL/d(depth)
  float weight;                       ///< Σ blending weight
  float max_weight;                   ///< Largest blending weight
  float unused[4];
};
static_assert(sizeof(SplatGradient) == 64);

/// A gaussian in one tile's list.
struct TileEntry {
  uint32_t slot;
  uint32_t instance;  ///< Where its gradient record lives.
};

/// Scratch memory for sorting, of one thread.
struct TileSorter {
  std::vector<uint64_t> keys, scratch;
  std::vector<TileEntry> unsorted;
};

/// The instances (gaussian, tile) of one slot: [first, first + count), counted from those of its projection task.
struct InstanceRange {
  uint32_t first, count;
};

/// Everything one view of the model needs between the stages. A visible block has a rank; slot = 64 * rank + lane.
struct Frame {
  int width = 0, height = 0;
  int tiles_x = 0, tiles_y = 0;
  int sh_degree = 0;
  float background[3] = {0, 0, 0};
  std::vector<AnchorView> anchors;

  std::vector<uint32_t> blocks;                   // [ranks] index of the block
  std::vector<uint64_t> visible;                  // [ranks] lanes that touch a tile
  Buffer<Splat> splats;                           // [slots]
  Buffer<InstanceRange> instances;                // [slots]; undefined for invisible lanes
  std::vector<std::vector<uint32_t>> task_tiles;  // [projection tasks] tile of each instance, in slot order
  int num_visible = 0;

  std::vector<uint32_t> task_begin;  // [projection tasks] their first instance
  std::vector<uint32_t> tile_begin;  // [tiles + 1] into entries
  Buffer<TileEntry> entries;         // [instances] by tile, front to back
  Buffer<uint64_t> cell_masks;       // [instances] cells that an entry contributes to
  uint32_t num_instances = 0;

  std::vector<TileSorter> sorters;  // [workers]

  Buffer<SplatGradient> gradients;  // [instances]

  int num_tiles() const { return tiles_x * tiles_y; }
  int num_ranks() const { return static_cast<int>(blocks.size()); }
  uint32_t first_instance(size_t slot) const {
    return instances[slot].first + task_begin[slot / (kBlockSize * kBlocksPerTask)];
  }
  int num_tasks() const { return (num_ranks() + kBlocksPerTask - 1) / kBlocksPerTask; }
};

}  // namespace photoslam::splatting
