// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/anchor_view.h"
#include "splatting/blending.h"
#include "splatting/cuda/group.h"
#include "splatting/formulas.h"
#include "splatting/model.h"

namespace photoslam::splatting::cuda {

inline constexpr int kTileSize = 16;  ///< Pixels per side; a tile is one thread block.
inline constexpr int kTilePixels = kTileSize * kTileSize;
inline constexpr int kPatchWidth = 8, kPatchHeight = 4;  ///< Pixels of one warp.

/// A projected gaussian. With t = dx − slope dy, (dx, dy) = pixel − (u, v):
/// log2(alpha) = log2_opacity + ka t² + kc dy².
struct alignas(16) Splat {
  float u, v;
  float slope;
  float ka, kc;
  float log2_opacity;
  float rgb[3];
  float z;
  float extent_x, extent_y;  ///< Half size of the cut ellipse's box [px].
};

/// Size of the image.
struct Extent {
  int width, height;
  PHOTOSLAM_DEVICE int tiles_x() const { return (width + kTileSize - 1) / kTileSize; }
  PHOTOSLAM_DEVICE int tiles_y() const { return (height + kTileSize - 1) / kTileSize; }
  PHOTOSLAM_DEVICE int tiles() const { return tiles_x() * tiles_y(); }
};

/// Projects one gaussian of a block.
PHOTOSLAM_DEVICE scalar::Projection<float> project_lane(const Block& block, uint32_t lane, const AnchorView& view) {
  float mean[3], rotation[4], log_scale[3];
  for (int i = 0; i < 3; ++i) mean[i] = block.parameters[row::kMean + i][lane];
  for (int i = 0; i < 4; ++i) rotation[i] = block.parameters[row::kRotation + i][lane];
  for (int i = 0; i < 3; ++i) log_scale[i] = block.parameters[row::kLogScale + i][lane];
  scalar::Projection<float> g;
  scalar::project(view, mean, rotation, log_scale, g);
  return g;
}

/// log2(alpha) at a pixel, and where it lies. Fused by hand: every kernel must round alike.
PHOTOSLAM_DEVICE float log2_alpha(const Splat& s, float x, float y, float& t, float& dy) {
  dy = y - s.v;
  t = fmaf(-s.slope, dy, x - s.u);
  return fmaf(s.kc * dy, dy, fmaf(s.ka * t, t, s.log2_opacity));
}

/// May the cut ellipse touch [x0, x1] x [y0, y1]? The smallest quadratic form of the rectangle decides: it lies on an
/// edge that faces the centre.
PHOTOSLAM_DEVICE bool touches(const Splat& s, float x0, float y0, float x1, float y1) {
  const float left = x0 - s.u, right = x1 - s.u, top = y0 - s.v, bottom = y1 - s.v;
  if (left > s.extent_x || -right > s.extent_x || top > s.extent_y || -bottom > s.extent_y) return false;
  const bool beside = left > 0 || right < 0;
  const bool above = top > 0 || bottom < 0;
  if (!beside && !above) return true;
  const float most = s.log2_opacity + kLog2Cut + 0.01f;  // what the form may reach, and a little for rounding
  if (beside) {
    const float dx = left > 0 ? left : right;
    const float best = s.ka * s.slope * dx / (s.ka * s.slope * s.slope + s.kc);
    const float dy = fminf(fmaxf(best, top), bottom), t = dx - s.slope * dy;
    if (-s.ka * t * t - s.kc * dy * dy <= most) return true;
  }
  if (above) {
    const float dy = top > 0 ? top : bottom;
    const float dx = fminf(fmaxf(s.slope * dy, left), right), t = dx - s.slope * dy;
    if (-s.ka * t * t - s.kc * dy * dy <= most) return true;
  }
  return false;
}

/// Calls f(tile) for the tiles with a pixel inside the splat's cut ellipse, row by row.
template <class F>
PHOTOSLAM_DEVICE void for_each_tile(const Splat& s, const Extent& image, F&& f) {
  const float last_x = static_cast<float>(image.width - 1), last_y = static_cast<float>(image.height - 1);
  const int left = static_cast<int>(ceilf(fmaxf(s.u - s.extent_x, 0.0f)));
  const int top = static_cast<int>(ceilf(fmaxf(s.v - s.extent_y, 0.0f)));
  const int right = static_cast<int>(floorf(fminf(s.u + s.extent_x, last_x)));
  const int bottom = static_cast<int>(floorf(fminf(s.v + s.extent_y, last_y)));
  for (int ty = top / kTileSize; ty <= bottom / kTileSize; ++ty)
    for (int tx = left / kTileSize; tx <= right / kTileSize; ++tx) {
      const float x0 = static_cast<float>(tx * kTileSize), y0 = static_cast<float>(ty * kTileSize);
      const float x1 = fminf(x0 + kTileSize - 1, last_x), y1 = fminf(y0 + kTileSize - 1, last_y);
      if (touches(s, x0, y0, x1, y1)) f(ty * image.tiles_x() + tx);
    }
}

/// Culling, projection and colours: one thread per slot of the model. Writes per slot a splat, its depth as a sorting
/// key and in how many tiles it lies (0 = not drawn).
struct ProjectKernel {
  static constexpr int kThreads = 128;
  using Shared = NoShared;
  const Block* blocks;
  uint32_t num_slots;
  const AnchorView* views;
  Extent image;
  int sh_degree;
  Splat* splats;
  uint32_t* keys;
  uint32_t* slots;
  uint32_t* tiles;
  uint32_t* num_visible;  ///< Counts on from what it holds.

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t slot = static_cast<uint32_t>(group.block() * kThreads + group.thread());
    Splat s;
    uint32_t count = 0;
    if (slot < num_slots && project(slot, s)) {
      for_each_tile(s, image, [&](int) { ++count; });
      if (count > 0) splats[slot] = s;
    }
    const uint32_t visible = group.ballot(count > 0);
    if (group.lane() == 0 && visible != 0) group.add(num_visible, count_bits(visible));
    if (slot >= num_slots) return;
    keys[slot] = count > 0 ? sortable_bits(s.z) : 0xffffffffu;
    slots[slot] = slot;
    tiles[slot] = count;
  }

  PHOTOSLAM_DEVICE bool project(uint32_t slot, Splat& s) const {
    const Block& block = blocks[slot / kBlockSize];
    const uint32_t lane = slot % kBlockSize;
    if (static_cast<int>(lane) >= block.count) return false;
    const AnchorView& view = views[block.anchor];
    const scalar::Projection<float> g = project_lane(block, lane, view);
    const float logit = block.parameters[row::kOpacity][lane];
    s.log2_opacity = -log2f(scalar::flattening(g) * (1.0f + expf(fminf(-logit, 80.0f))));
    const float cut = s.log2_opacity + kLog2Cut;
    const float radius2 = cut * (2.0f * 0.6931471805599453f), half_log2e = 0.5f * 1.4426950408889634f;
    const float inv_c = 1.0f / g.c, inv_det = 1.0f / g.det;
    s.extent_x = sqrtf(radius2 * g.a);
    s.extent_y = sqrtf(radius2 * g.c);
    s.u = g.u;
    s.v = g.v;
    s.slope = g.b * inv_c;
    s.ka = -half_log2e * g.c * inv_det;
    s.kc = -half_log2e * inv_c;
    s.z = g.p[2];
    // Not-a-number fails every comparison: garbage never passes.
    bool ok = (s.z > view.near) & (s.z < kAbsurd) & (cut > 0) & (logit < kAbsurd) & (g.a < kAbsurd) & (g.c < kAbsurd) &
              (g.inv_norm > 1.0f / kAbsurd) & (g.det > 0) & (inv_det > 0) & (s.u + s.extent_x >= 0) &
              (s.v + s.extent_y >= 0) & (s.u - s.extent_x <= static_cast<float>(image.width - 1)) &
              (s.v - s.extent_y <= static_cast<float>(image.height - 1));
    for (int i = 0; i < 3; ++i) ok = ok & (fabsf(block.parameters[row::kLogScale + i][lane]) < kAbsurd);
    if (!ok) return false;
    float direction[3], basis[kNumShCoefficients];
    const int coefficients = (sh_degree + 1) * (sh_degree + 1);
    scalar::normalize(g.offset, direction);
    scalar::sh_basis(sh_degree, direction, basis);
    for (int c = 0; c < 3; ++c) {
      float color = 0.5f;
      for (int k = 0; k < coefficients; ++k)
        color = fmaf(basis[k], block.parameters[row::kSh + 3 * k + c][lane], color);
      ok = ok & (fabsf(color) < kAbsurd);
      s.rgb[c] = fmaxf(color, 0.0f);
    }
    return ok;
  }
};

/// Gathers the tile counts in order of depth, for their prefix sums; zeros beyond, up to `num_counts`.
struct GatherCounts {
  static constexpr int kThreads = 256;
  using Shared = NoShared;
  const uint32_t* order;
  const uint32_t* tiles;
  uint32_t num_slots;
  uint32_t num_counts;
  uint32_t* counts;
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t i = static_cast<uint32_t>(group.block() * kThreads + group.thread());
    if (i < num_counts) counts[i] = i < num_slots ? tiles[order[i]] : 0;
  }
};

/// Writes the instances (splat, tile) front to back: tile as key, own position as value, and whose they are. Whatever
/// lies beyond `capacity` is left out.
struct EmitInstances {
  static constexpr int kThreads = 128;
  using Shared = NoShared;
  const uint32_t* order;
  const uint32_t* tiles;
  const uint32_t* offsets;  ///< Of order[i]; saturated where they are greater than any capacity.
  uint32_t num_slots;
  const Splat* splats;
  Extent image;
  uint32_t capacity;
  uint32_t* keys;
  uint32_t* positions;
  uint32_t* instance_slots;
  uint32_t* first_instance;  ///< [slots]
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t i = static_cast<uint32_t>(group.block() * kThreads + group.thread());
    if (i >= num_slots) return;
    const uint32_t slot = order[i], count = tiles[slot], first = offsets[i];
    first_instance[slot] = first;
    if (count == 0 || first >= capacity) return;
    uint32_t n = 0;
    const auto emit = [&](int tile) {
      const uint32_t at = first + n;
      if (n++ >= count || at >= capacity) return;
      keys[at] = static_cast<uint32_t>(tile);
      positions[at] = at;
      instance_slots[at] = slot;
    };
    for_each_tile(splats[slot], image, emit);
    while (n < count) emit(image.tiles());  // in no tile
  }
};

/// Bounds the number of instances by the memory there is; `lost` says how many there was no room for.
struct BoundInstances {
  static constexpr int kThreads = 32;
  using Shared = NoShared;
  uint32_t* size;
  uint32_t capacity;
  uint32_t* lost;
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    if (group.thread() != 0) return;
    *lost = *size > capacity ? *size - capacity : 0;
    *size = *size > capacity ? capacity : *size;
  }
};

/// Where the sorted instances of each tile begin: [tiles + 1].
struct FindTiles {
  static constexpr int kThreads = 256;
  using Shared = NoShared;
  const uint32_t* keys;
  const uint32_t* size;
  uint32_t num_tiles;
  uint32_t* begin;
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t i = static_cast<uint32_t>(group.block() * kThreads + group.thread());
    if (i > *size) return;
    const uint32_t from = i == 0 ? 0 : keys[i - 1] + 1;
    const uint32_t to = i == *size ? num_tiles : keys[i];
    for (uint32_t tile = from; tile <= to && tile <= num_tiles; ++tile) begin[tile] = i;
  }
};

/// Number of buckets of 32 instances of each tile; prefix sums make them where the tile's buckets begin. Zeros beyond,
/// up to `num_counts`.
struct CountBuckets {
  static constexpr int kThreads = 256;
  using Shared = NoShared;
  const uint32_t* tile_begin;
  uint32_t num_tiles;
  uint32_t num_counts;
  uint32_t* counts;
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t i = static_cast<uint32_t>(group.block() * kThreads + group.thread());
    if (i < num_tiles) counts[i] = (tile_begin[i + 1] - tile_begin[i] + kWarpSize - 1) / kWarpSize;
    if (i >= num_tiles && i < num_counts) counts[i] = 0;
  }
};

}  // namespace photoslam::splatting::cuda
