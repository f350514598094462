// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Stable sorting and prefix sums of 32-bit numbers on the device; how many there are is known only there.

#include "splatting/cuda/group.h"

namespace photoslam::splatting::cuda {

inline constexpr int kSortThreads = 256;
inline constexpr int kSortWarps = kSortThreads / kWarpSize;
inline constexpr int kSortRounds = 8;
inline constexpr uint32_t kSortBatch = kSortThreads * kSortRounds;  ///< Items of one thread block.
inline constexpr uint32_t kRadix = 256;

/// Thread blocks for at most `capacity` items.
constexpr int num_sort_blocks(uint32_t capacity) { return static_cast<int>((capacity + kSortBatch - 1) / kSortBatch); }

/// First kernel of a radix pass over digit (key >> shift) & 255: histogram [kRadix, blocks].
struct CountDigits {
  static constexpr int kThreads = kSortThreads;
  struct Shared {
    uint32_t counts[kRadix];
  };
  const uint32_t* keys;
  const uint32_t* size;
  int shift;
  uint32_t* histogram;

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const uint32_t thread = static_cast<uint32_t>(group.thread()), block = static_cast<uint32_t>(group.block());
    shared.counts[thread] = 0;
    group.sync();
    for (uint32_t round = 0; round < kSortRounds; ++round) {
      const uint32_t i = block * kSortBatch + round * kSortThreads + thread;
      if (i < *size) group.add(&shared.counts[(keys[i] >> shift) & (kRadix - 1)], 1);
    }
    group.sync();
    histogram[thread * static_cast<uint32_t>(group.num_blocks()) + block] = shared.counts[thread];
  }
};

/// Sums that 32 bits do not hold stay at the largest number.
PHOTOSLAM_DEVICE uint32_t saturating_sum(uint32_t a, uint32_t b) {
  const uint32_t sum = a + b;
  return sum < a ? 0xffffffffu : sum;
}

/// Exclusive saturating sum of one value per thread over its block; `total` is the sum of all. Uses `scratch`
/// [2, threads].
template <class Group>
PHOTOSLAM_DEVICE uint32_t block_prefix(Group& group, uint32_t value, uint32_t* scratch, uint32_t threads,
                                       uint32_t& total) {
  const uint32_t thread = static_cast<uint32_t>(group.thread());
  uint32_t* from = scratch;
  uint32_t* to = scratch + threads;
  from[thread] = value;
  group.sync();
  for (uint32_t step = 1; step < threads; step *= 2) {
    to[thread] = saturating_sum(from[thread], thread >= step ? from[thread - step] : 0);
    group.sync();
    uint32_t* const swap = from;
    from = to;
    to = swap;
  }
  const uint32_t before = thread > 0 ? from[thread - 1] : 0;
  total = from[threads - 1];
  group.sync();
  return before;
}

/// Exclusive saturating prefix sums of `rows` rows of `columns` numbers, in place, one thread block per row; totals
/// [rows].
struct PrefixRows {
  static constexpr int kThreads = kSortThreads;
  struct Shared {
    uint32_t scratch[2 * kSortThreads];
  };
  uint32_t* values;
  uint32_t columns;
  uint32_t* totals;

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const uint32_t row = static_cast<uint32_t>(group.block());
    uint32_t sum = 0;
    for (uint32_t first = 0; first < columns; first += kSortThreads) {
      const uint32_t i = first + static_cast<uint32_t>(group.thread());
      uint32_t total = 0;
      const uint32_t value = i < columns ? values[row * columns + i] : 0;
      const uint32_t before = block_prefix(group, value, shared.scratch, kSortThreads, total);
      if (i < columns) values[row * columns + i] = saturating_sum(sum, before);
      sum = saturating_sum(sum, total);
    }
    if (group.thread() == 0) totals[row] = sum;
  }
};

/// Second level of long prefix sums: adds to each row what the rows before it sum up to. One thread block per row.
struct AddToRows {
  static constexpr int kThreads = kSortThreads;
  using Shared = NoShared;
  uint32_t* values;
  uint32_t columns;
  const uint32_t* offsets;  ///< [rows]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t row = static_cast<uint32_t>(group.block());
    for (uint32_t i = static_cast<uint32_t>(group.thread()); i < columns; i += kSortThreads)
      values[row * columns + i] = saturating_sum(values[row * columns + i], offsets[row]);
  }
};

/// Last kernel of a radix pass: moves keys and values to their places. `histogram` and `totals` after PrefixRows.
struct ScatterDigits {
  static constexpr int kThreads = kSortThreads;
  struct Shared {
    uint32_t scratch[2 * kSortThreads];
    uint32_t next[kRadix];                ///< Where the next item of a digit goes.
    uint32_t counts[kSortWarps][kRadix];  ///< Of a round.
  };
  const uint32_t* keys;
  const uint32_t* values;
  const uint32_t* size;
  int shift;
  const uint32_t* histogram;
  const uint32_t* totals;
  uint32_t* sorted_keys;
  uint32_t* sorted_values;

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared& shared) const {
    const uint32_t thread = static_cast<uint32_t>(group.thread()), block = static_cast<uint32_t>(group.block());
    const uint32_t lane = static_cast<uint32_t>(group.lane()), warp = static_cast<uint32_t>(group.warp());
    uint32_t all = 0;
    const uint32_t first = block_prefix(group, totals[thread], shared.scratch, kSortThreads, all);
    shared.next[thread] = first + histogram[thread * static_cast<uint32_t>(group.num_blocks()) + block];
    for (uint32_t round = 0; round < kSortRounds; ++round) {
      for (uint32_t w = 0; w < kSortWarps; ++w) shared.counts[w][thread] = 0;
      group.sync();
      const uint32_t i = block * kSortBatch + round * kSortThreads + thread;
      const bool is_item = i < *size;
      const uint32_t key = is_item ? keys[i] : 0;
      const uint32_t digit = is_item ? (key >> shift) & (kRadix - 1) : kRadix;
      const uint32_t peers = group.match(digit);
      const uint32_t rank = count_bits(peers & ((1u << lane) - 1));
      if (is_item && rank == 0) shared.counts[warp][digit] = count_bits(peers);
      group.sync();
      uint32_t at = shared.next[thread];
      for (uint32_t w = 0; w < kSortWarps; ++w) {
        const uint32_t count = shared.counts[w][thread];
        shared.counts[w][thread] = at;
        at += count;
      }
      shared.next[thread] = at;
      group.sync();
      if (is_item) {
        const uint32_t to = shared.counts[warp][digit] + rank;
        sorted_keys[to] = key;
        sorted_values[to] = values[i];
      }
      group.sync();
    }
  }
};

}  // namespace photoslam::splatting::cuda
