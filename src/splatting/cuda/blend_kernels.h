// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/cuda/project_kernels.h"

namespace photoslam::splatting::cuda {

/// What the splats before a bucket have done to a pixel. `running` is the product of all 1 − alpha so far.
struct Checkpoint {
  float running;
  float rgb[3];
  float depth;
};

/// Lists of a view after sorting: entry i of a tile, front to back, is instance entries[tile_begin[tile] + i].
struct TileLists {
  const Splat* splats;
  const uint32_t* entries;         ///< Positions as emitted.
  const uint32_t* instance_slots;  ///< [emitted]
  const uint32_t* tile_begin;      ///< [tiles + 1]
  const uint32_t* bucket_begin;    ///< [tiles]
  PHOTOSLAM_DEVICE const Splat& splat(uint32_t entry) const { return splats[instance_slots[entries[entry]]]; }
};

/// Pixel of a thread inside its tile: warps own patches of 8x4.
PHOTOSLAM_DEVICE int pixel_x(int thread) {
  return (thread / kWarpSize % 2) * kPatchWidth + thread % kWarpSize % kPatchWidth;
}
PHOTOSLAM_DEVICE int pixel_y(int thread) {
  return (thread / kWarpSize / 2) * kPatchHeight + thread % kWarpSize / kPatchWidth;
}

/// Blends every tile front to back (paper Eq. 3): one thread per pixel; a warp skips the splats that miss its patch.
/// Leaves a checkpoint per pixel and bucket of 32 entries, and how many buckets were looked at. Planes as in
/// RenderResult.
struct BlendKernel {
  static constexpr int kThreads = kTilePixels;
  struct Shared {
    Splat splats[kTilePixels];
  };
  TileLists lists;
  Extent image;
  float background[3];
  Checkpoint* checkpoints;  ///< [buckets, kTilePixels], or null: nobody will go back.
  uint32_t* used_buckets;   ///< [tiles]
  float* rgb;
  float* depth;
  float* alpha;

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const int thread = group.thread(), tile = group.block();
    const int x0 = tile % image.tiles_x() * kTileSize, y0 = tile / image.tiles_x() * kTileSize;
    const int x = x0 + pixel_x(thread), y = y0 + pixel_y(thread);
    const bool inside = x < image.width && y < image.height;
    const float left = static_cast<float>(x0 + pixel_x(group.warp() * kWarpSize));
    const float top = static_cast<float>(y0 + pixel_y(group.warp() * kWarpSize));
    const uint32_t begin = lists.tile_begin[tile], end = lists.tile_begin[tile + 1];
    Checkpoint state{inside ? 1.0f : 0.0f, {0, 0, 0}, 0};
    float transmittance = 1;
    uint32_t buckets = 0;
    for (uint32_t first = begin; first < end; first += kTilePixels) {
      if (!group.sync_any(state.running > kMinTransmittance)) break;
      if (first + static_cast<uint32_t>(thread) < end)
        shared.splats[thread] = lists.splat(first + static_cast<uint32_t>(thread));
      group.sync();
      for (uint32_t from = 0; from < kTilePixels && first + from < end; from += kWarpSize) {
        if (checkpoints != nullptr)
          checkpoints[(lists.bucket_begin[tile] + buckets) * kTilePixels + static_cast<uint32_t>(thread)] = state;
        ++buckets;
        const uint32_t mine = from + static_cast<uint32_t>(group.lane());
        const bool hit = first + mine < end &&
                         touches(shared.splats[mine], left, top, left + (kPatchWidth - 1), top + (kPatchHeight - 1));
        for (uint32_t rest = group.ballot(hit); rest != 0; rest &= rest - 1)
          blend(shared.splats[from + static_cast<uint32_t>(lowest_bit(rest))], static_cast<float>(x),
                static_cast<float>(y), state, transmittance);
      }
    }
    if (thread == 0) used_buckets[tile] = buckets;
    if (!inside) return;
    const int plane = image.width * image.height, pixel = y * image.width + x;
    for (int c = 0; c < 3; ++c) rgb[c * plane + pixel] = fmaf(transmittance, background[c], state.rgb[c]);
    depth[pixel] = state.depth;
    alpha[pixel] = 1.0f - transmittance;
  }

  PHOTOSLAM_DEVICE static void blend(const Splat& s, float x, float y, Checkpoint& state, float& transmittance) {
    float t, dy;
    const float exponent = log2_alpha(s, x, y, t, dy);
    if (exponent < -kLog2Cut) return;
    const float a = fminf(exp2f(exponent), kMaxAlpha);
    const float after = fmaf(-a, state.running, state.running);
    if (after > kMinTransmittance) {
      const float weight = a * state.running;
      for (int c = 0; c < 3; ++c) state.rgb[c] = fmaf(weight, s.rgb[c], state.rgb[c]);
      state.depth = fmaf(weight, s.z, state.depth);
      transmittance = after;
    }
    state.running = after;
  }
};

/// Sums over the pixels of one tile, h = dL/d(ln alpha): the gradient record of one (splat, tile).
struct alignas(16) SplatGradient {
  float t, dy, tt, t_dy, dy_dy, one;  ///< Σ h {t, dy, t², t dy, dy², 1}
  float rgb[3];
  float z;
  float weight, max_weight;
};

/// Instances in no tile are sorted behind all tiles; nobody blends them, so their gradient records are zero.
struct ClearRecords {
  static constexpr int kThreads = 256;
  using Shared = NoShared;
  const uint32_t* entries;
  const uint32_t* end_of_tiles;
  const uint32_t* size;
  SplatGradient* records;
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t first = *end_of_tiles + static_cast<uint32_t>(group.block() * kThreads + group.thread());
    for (uint32_t i = first; i < *size; i += static_cast<uint32_t>(group.num_blocks() * kThreads))
      records[entries[i]] = SplatGradient{};
  }
};

/// A pixel on its way through the lanes of a warp. `behind`: Σ over the splats to come of weight times (gradient ·
/// value), the background included.
struct TravellingPixel {
  float running, behind;
  float rgb[3], depth;  ///< dL/d(pixel)
};

/// The way back, per splat: a warp takes a bucket, a lane a splat; the pixels of the tile travel through the lanes in
/// blending order, starting from the bucket's checkpoint. One record per instance at its emitted position: no atomics,
/// hence equal sums in every run.
struct UnblendKernel {
  static constexpr int kThreads = 128;
  static constexpr int kWarps = kThreads / kWarpSize;
  struct Shared {
    TravellingPixel pixels[kWarps][kWarpSize];
  };
  TileLists lists;
  Extent image;
  const Checkpoint* checkpoints;
  const uint32_t* used_buckets;
  const uint32_t* num_buckets;
  const float* rgb;
  const float* depth;
  const float* alpha;
  const float* dl_drgb;
  const float* dl_ddepth;  ///< Or null.
  const float* dl_dalpha;  ///< Or null.
  SplatGradient* gradients;

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const uint32_t stride = static_cast<uint32_t>(group.num_blocks() * kWarps);
    for (uint32_t bucket = static_cast<uint32_t>(group.block() * kWarps + group.warp()); bucket < *num_buckets;
         bucket += stride)
      unblend_bucket(group, bucket, shared.pixels[group.warp()]);
  }

  /// The tile of a bucket: the last whose buckets begin at or before it and that has any.
  PHOTOSLAM_DEVICE uint32_t tile_of(uint32_t bucket) const {
    uint32_t low = 0, high = static_cast<uint32_t>(image.tiles());
    while (high - low > 1) {
      const uint32_t middle = (low + high) / 2;
      if (lists.bucket_begin[middle] <= bucket)
        low = middle;
      else
        high = middle;
    }
    return low;
  }

  template <class Group>
  PHOTOSLAM_DEVICE void unblend_bucket(Group& group, uint32_t bucket, TravellingPixel* pixels) const {
    const int lane = group.lane();
    const uint32_t tile = tile_of(bucket), nth = bucket - lists.bucket_begin[tile];
    const uint32_t entry = lists.tile_begin[tile] + nth * kWarpSize + static_cast<uint32_t>(lane);
    const bool has_splat = entry < lists.tile_begin[tile + 1];
    const int x0 = static_cast<int>(tile) % image.tiles_x() * kTileSize;
    const int y0 = static_cast<int>(tile) / image.tiles_x() * kTileSize;
    SplatGradient sums{};
    if (nth < used_buckets[tile]) {
      Splat s{};
      if (has_splat) s = lists.splat(entry);
      TravellingPixel pixel{};
      for (int step = 0; step < kTilePixels + kWarpSize - 1; ++step) {
        if (step % kWarpSize == 0) {
          group.sync_warp();
          if (step < kTilePixels) pixels[lane] = load(bucket, step + lane, x0, y0);
          group.sync_warp();
        }
        pixel = group.from_previous(pixel);
        if (lane == 0) pixel = step < kTilePixels ? pixels[step % kWarpSize] : TravellingPixel{};
        const int index = step - lane;
        if (has_splat && index >= 0 && index < kTilePixels)
          unblend(s, static_cast<float>(x0 + pixel_x(index)), static_cast<float>(y0 + pixel_y(index)), pixel, sums);
      }
    }
    if (has_splat) gradients[lists.entries[entry]] = sums;
  }

  PHOTOSLAM_DEVICE TravellingPixel load(uint32_t bucket, int index, int x0, int y0) const {
    TravellingPixel p{};
    const int x = x0 + pixel_x(index), y = y0 + pixel_y(index);
    if (x >= image.width || y >= image.height) return p;
    const Checkpoint before = checkpoints[bucket * kTilePixels + static_cast<uint32_t>(index)];
    const int plane = image.width * image.height, pixel = y * image.width + x;
    p.running = before.running;
    for (int c = 0; c < 3; ++c) {
      p.rgb[c] = dl_drgb[c * plane + pixel];
      p.behind = fmaf(p.rgb[c], rgb[c * plane + pixel] - before.rgb[c], p.behind);
    }
    if (dl_ddepth != nullptr) {
      p.depth = dl_ddepth[pixel];
      p.behind = fmaf(p.depth, depth[pixel] - before.depth, p.behind);
    }
    if (dl_dalpha != nullptr) p.behind = fmaf(-dl_dalpha[pixel], 1.0f - alpha[pixel], p.behind);
    return p;
  }

  PHOTOSLAM_DEVICE static void unblend(const Splat& s, float x, float y, TravellingPixel& p, SplatGradient& sums) {
    float t, dy;
    const float exponent = log2_alpha(s, x, y, t, dy);
    if (exponent < -kLog2Cut || p.running <= kMinTransmittance) return;
    const float a = fminf(exp2f(exponent), kMaxAlpha);
    const float after = fmaf(-a, p.running, p.running);
    const float weight = a * p.running;
    p.running = after;
    if (!(after > kMinTransmittance)) return;
    const float value = fmaf(p.rgb[0], s.rgb[0], fmaf(p.rgb[1], s.rgb[1], fmaf(p.rgb[2], s.rgb[2], p.depth * s.z)));
    p.behind = fmaf(-weight, value, p.behind);
    for (int c = 0; c < 3; ++c) sums.rgb[c] = fmaf(weight, p.rgb[c], sums.rgb[c]);
    sums.z = fmaf(weight, p.depth, sums.z);
    sums.weight += weight;
    sums.max_weight = fmaxf(sums.max_weight, weight);
    if (a >= kMaxAlpha) return;  // a clamped alpha does not follow its exponent
    const float h = fmaf(weight, value, -p.behind * a / (1.0f - a));
    sums.t = fmaf(h, t, sums.t);
    sums.dy = fmaf(h, dy, sums.dy);
    sums.tt = fmaf(h * t, t, sums.tt);
    sums.t_dy = fmaf(h * t, dy, sums.t_dy);
    sums.dy_dy = fmaf(h * dy, dy, sums.dy_dy);
    sums.one += h;
  }
};

}  // namespace photoslam::splatting::cuda
