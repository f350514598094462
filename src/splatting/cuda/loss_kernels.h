// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The losses of splatting/loss.h and their gradient images, one thread block per tile and colour channel.

#include "splatting/cuda/project_kernels.h"
#include "splatting/loss_constants.h"

namespace photoslam::splatting::cuda {

inline constexpr int kHalo = kSsimRadius;
inline constexpr int kWindowSize = kTileSize + 2 * kHalo;  ///< Pixels per side that a tile's SSIM depends on.

/// What is summed over the pixels of a channel. Partial sums lie in rows [3 channels][kLossSums][tiles].
enum LossSum { kSumL1, kSumMse, kSumBias, kSumValue, kSumSsim, kLossSums };

/// The images that are compared, all on the device.
struct Comparison {
  const float* render;    ///< [3, H, W]
  const uint8_t* target;  ///< [3, H, W]
  const uint8_t* mask;    ///< [H, W]: 0 = no data; or null
  Extent image;
  float gain[3], bias[3];  ///< Exposure.

  PHOTOSLAM_DEVICE bool has_data(int x, int y) const {
    return x >= 0 && x < image.width && y >= 0 && y < image.height &&
           (mask == nullptr || mask[y * image.width + x] != 0);
  }
  /// The compared values of a pixel: exposure applied, zero where there is no data.
  PHOTOSLAM_DEVICE void load(int channel, int x, int y, float& a, float& b) const {
    a = b = 0;
    if (!has_data(x, y)) return;
    const int at = channel * image.width * image.height + y * image.width + x;
    a = fmaf(gain[channel], render[at], bias[channel]);
    b = static_cast<float>(target[at]) * (1.0f / 255.0f);
  }
};

/// The part of a loss that a thread block works on: a tile, upper left pixel (x0, y0), of one channel.
struct ChannelTile {
  int tile, channel, x0, y0;
  PHOTOSLAM_DEVICE ChannelTile(int block, const Extent& image)
      : tile(block % image.tiles()),
        channel(block / image.tiles()),
        x0(tile % image.tiles_x() * kTileSize),
        y0(tile / image.tiles_x() * kTileSize) {}
};

inline constexpr int kTileWarps = kTilePixels / kWarpSize;

/// Sums of values over the block's threads, in a fixed order; thread 0 gets them. `scratch` [kCount] rows.
template <int kCount, class Group>
PHOTOSLAM_DEVICE void block_sums(Group& group, float (&values)[kCount], float (*scratch)[kTileWarps]) {
  for (int i = 0; i < kCount; ++i) {
    for (int mask = kWarpSize / 2; mask > 0; mask /= 2) values[i] += group.exchange(values[i], mask);
    if (group.lane() == 0) scratch[i][group.warp()] = values[i];
  }
  group.sync();
  if (group.thread() != 0) return;
  for (int i = 0; i < kCount; ++i) {
    values[i] = 0;
    for (int warp = 0; warp < kTileWarps; ++warp) values[i] += scratch[i][warp];
  }
}

/// Filters a row [kWindowSize] around column x of the tile.
PHOTOSLAM_DEVICE float filter_row(const float* row, int x) {
  float sum = kSsimTap0 * row[x + kHalo];
  const float taps[kSsimRadius] = {kSsimTap1, kSsimTap2, kSsimTap3, kSsimTap4, kSsimTap5};
  PHOTOSLAM_UNROLL
  for (int k = 1; k <= kSsimRadius; ++k) sum = fmaf(taps[k - 1], row[x + kHalo - k] + row[x + kHalo + k], sum);
  return sum;
}
/// The same along a column of rows [kWindowSize, kTileSize].
PHOTOSLAM_DEVICE float filter_column(const float (*rows)[kTileSize], int x, int y) {
  float sum = kSsimTap0 * rows[y + kHalo][x];
  const float taps[kSsimRadius] = {kSsimTap1, kSsimTap2, kSsimTap3, kSsimTap4, kSsimTap5};
  PHOTOSLAM_UNROLL
  for (int k = 1; k <= kSsimRadius; ++k) sum = fmaf(taps[k - 1], rows[y + kHalo - k][x] + rows[y + kHalo + k][x], sum);
  return sum;
}

/// SSIM of every pixel and its derivatives by the three filtered quantities that depend on the render: by the mean of
/// a, of a², and of a b. Thread blocks: tiles * 3, channel by channel.
struct SsimKernel {
  static constexpr int kThreads = kTilePixels;
  struct Shared {
    float a[kWindowSize][kWindowSize], b[kWindowSize][kWindowSize];
    float rows[4][kWindowSize][kTileSize];  ///< a, b, a² + b², a b, filtered along rows
    float scratch[1][kTileWarps];
  };
  Comparison images;
  float* derivatives;  ///< [3 channels][3][H, W]
  float* sums;         ///< [3][kLossSums][tiles]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const Extent& image = images.image;
    const auto [tile, channel, x0, y0] = ChannelTile(group.block(), image);
    const int thread = group.thread();
    for (int i = thread; i < kWindowSize * kWindowSize; i += kThreads) {
      const int x = i % kWindowSize, y = i / kWindowSize;
      images.load(channel, x0 + x - kHalo, y0 + y - kHalo, shared.a[y][x], shared.b[y][x]);
    }
    group.sync();
    for (int i = thread; i < kWindowSize * kTileSize; i += kThreads)
      filter_signals(shared, i % kTileSize, i / kTileSize);
    group.sync();
    const int x = thread % kTileSize, y = thread / kTileSize;
    float ssim[1] = {0};
    if (x0 + x < image.width && y0 + y < image.height) ssim[0] = compare(shared, channel, x0, y0, x, y);
    block_sums(group, ssim, shared.scratch);
    if (thread == 0) sums[(channel * kLossSums + kSumSsim) * image.tiles() + tile] = ssim[0];
  }

  PHOTOSLAM_DEVICE static void filter_signals(Shared& shared, int x, int y) {
    const float taps[kSsimRadius + 1] = {kSsimTap0, kSsimTap1, kSsimTap2, kSsimTap3, kSsimTap4, kSsimTap5};
    float sum[4] = {0, 0, 0, 0};
    PHOTOSLAM_UNROLL
    for (int k = -kSsimRadius; k <= kSsimRadius; ++k) {
      const float a = shared.a[y][x + kHalo + k], b = shared.b[y][x + kHalo + k], tap = taps[k < 0 ? -k : k];
      sum[0] = fmaf(tap, a, sum[0]);
      sum[1] = fmaf(tap, b, sum[1]);
      sum[2] = fmaf(tap, fmaf(a, a, b * b), sum[2]);
      sum[3] = fmaf(tap, a * b, sum[3]);
    }
    for (int i = 0; i < 4; ++i) shared.rows[i][y][x] = sum[i];
  }

  PHOTOSLAM_DEVICE float compare(const Shared& shared, int channel, int x0, int y0, int x, int y) const {
    const int width = images.image.width, plane = width * images.image.height;
    const float mu_a = filter_column(shared.rows[0], x, y), mu_b = filter_column(shared.rows[1], x, y);
    const float squares = fmaf(mu_a, mu_a, mu_b * mu_b), product = mu_a * mu_b;
    const float a1 = fmaf(2.0f, product, kSsimC1);
    const float a2 = fmaf(2.0f, filter_column(shared.rows[3], x, y) - product, kSsimC2);
    const float inv_b1 = 1.0f / (squares + kSsimC1);
    const float inv_b2 = 1.0f / (filter_column(shared.rows[2], x, y) - squares + kSsimC2);
    const float inv = inv_b1 * inv_b2;
    const float valid = images.has_data(x0 + x, y0 + y) ? 1.0f : 0.0f;
    const float ssim = a1 * a2 * inv * valid;
    float* out = derivatives + 3 * channel * plane + (y0 + y) * width + x0 + x;
    out[0] = 2.0f * fmaf(mu_a * ssim, inv_b2 - inv_b1, mu_b * (a2 - a1) * (inv * valid));
    out[plane] = -ssim * inv_b2;
    out[2 * plane] = 2.0f * a1 * inv * valid;
    return ssim;
  }
};

/// dL/d(render) of the photometric loss, and the sums of all its terms but SSIM. Thread blocks as SsimKernel.
struct PhotometricKernel {
  static constexpr int kThreads = kTilePixels;
  struct Shared {
    float window[kWindowSize][kWindowSize];
    float rows[kWindowSize][kTileSize];
    float scratch[kSumSsim][kTileWarps];
  };
  Comparison images;
  const float* derivatives;  ///< Of SsimKernel, or null: without SSIM.
  float l1_scale;            ///< (1 − λ) / number of compared values
  float ssim_scale;          ///< λ / number of compared values
  float* gradient;           ///< [3, H, W]
  float* sums;               ///< [3][kLossSums][tiles]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const Extent& image = images.image;
    const auto [tile, channel, x0, y0] = ChannelTile(group.block(), image);
    const int thread = group.thread(), x = x0 + thread % kTileSize, y = y0 + thread / kTileSize;
    float a = 0, b = 0;
    images.load(channel, x, y, a, b);
    float by_ssim = 0;
    if (derivatives != nullptr) {
      by_ssim = filtered(group, shared, channel, 0, x0, y0);
      by_ssim = fmaf(2.0f * a, filtered(group, shared, channel, 1, x0, y0), by_ssim);
      by_ssim = fmaf(b, filtered(group, shared, channel, 2, x0, y0), by_ssim);
    }
    const float difference = a - b;
    const float clamped = fminf(fmaxf(a, 0.0f), 1.0f) - b;
    float by_value = 0;
    if (images.has_data(x, y)) {
      const float sign = difference > 0 ? l1_scale : difference < 0 ? -l1_scale : 0.0f;
      by_value = fmaf(-ssim_scale, by_ssim, sign);
    }
    if (x < image.width && y < image.height)
      gradient[(channel * image.height + y) * image.width + x] = by_value * images.gain[channel];
    float terms[kSumSsim] = {fabsf(difference), clamped * clamped, by_value, by_value * a};
    block_sums(group, terms, shared.scratch);
    if (thread != 0) return;
    for (int i = 0; i < kSumSsim; ++i) sums[(channel * kLossSums + i) * image.tiles() + tile] = terms[i];
  }

  /// One derivative, filtered around this thread's pixel.
  template <class Group>
  PHOTOSLAM_DEVICE float filtered(Group& group, Shared& shared, int channel, int which, int x0, int y0) const {
    const Extent& image = images.image;
    const float* from = derivatives + (3 * channel + which) * image.width * image.height;
    const int thread = group.thread();
    for (int i = thread; i < kWindowSize * kWindowSize; i += kThreads) {
      const int x = x0 + i % kWindowSize - kHalo, y = y0 + i / kWindowSize - kHalo;
      const bool inside = x >= 0 && x < image.width && y >= 0 && y < image.height;
      shared.window[i / kWindowSize][i % kWindowSize] = inside ? from[y * image.width + x] : 0.0f;
    }
    group.sync();
    for (int i = thread; i < kWindowSize * kTileSize; i += kThreads)
      shared.rows[i / kTileSize][i % kTileSize] = filter_row(shared.window[i / kTileSize], i % kTileSize);
    group.sync();
    const float sum = filter_column(shared.rows, thread % kTileSize, thread / kTileSize);
    group.sync();
    return sum;
  }
};

/// Depth loss (see depth_loss()): gradients by depth and alpha, and the sum of |D − A d|, one per thread block.
struct DepthLossKernel {
  static constexpr int kThreads = kTilePixels;
  struct Shared {
    float scratch[1][kTileWarps];
  };
  const float* depth;
  const float* alpha;
  const uint16_t* truth;
  int pixels;
  float unit;
  float scale;  ///< weight / number of pixels with depth
  float* dl_ddepth;
  float* dl_dalpha;
  float* sums;  ///< [blocks]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const int i = group.block() * kThreads + group.thread();
    float residual = 0;
    if (i < pixels) {
      const float d = static_cast<float>(truth[i]) * unit;
      residual = truth[i] != 0 ? depth[i] - alpha[i] * d : 0.0f;
      const float sign = residual > 0 ? scale : residual < 0 ? -scale : 0.0f;
      dl_ddepth[i] = sign;
      dl_dalpha[i] = -sign * d;
    }
    float sum[1] = {fabsf(residual)};
    block_sums(group, sum, shared.scratch);
    if (group.thread() == 0) sums[group.block()] = sum[0];
  }
};

/// Sums of rows [rows, columns] in double precision and a fixed order: one thread block per row.
struct SumRows {
  static constexpr int kThreads = 256;
  struct Shared {
    double scratch[256];
  };
  const float* values;
  int columns;
  double* sums;

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const int thread = group.thread();
    double sum = 0;
    for (int i = thread; i < columns; i += kThreads)
      sum += static_cast<double>(
          values[static_cast<size_t>(group.block()) * static_cast<size_t>(columns) + static_cast<size_t>(i)]);
    shared.scratch[thread] = sum;
    group.sync();
    for (int step = kThreads / 2; step > 0; step /= 2) {
      if (thread < step) shared.scratch[thread] += shared.scratch[thread + step];
      group.sync();
    }
    if (thread == 0) sums[group.block()] = shared.scratch[0];
  }
};

}  // namespace photoslam::splatting::cuda
