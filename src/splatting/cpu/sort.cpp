// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/sort.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <utility>

#include "base/check.h"

namespace photoslam::splatting {
namespace {

/// Makes instance ranges absolute and gathers the instances' tiles in one array, in slot order.
void number_instances(Frame& frame) {
  uint64_t total = 0;
  for (int task = 0; task < frame.num_tasks(); ++task) total += frame.task_tiles[static_cast<size_t>(task)].size();
  PHOTOSLAM_CHECK(total < std::numeric_limits<uint32_t>::max(), "{} (gaussian, tile) pairs in one view", total);
  frame.num_instances = static_cast<uint32_t>(total);
  frame.tile_of_instance.reserve(total);
  uint32_t base = 0;
  for (int task = 0; task < frame.num_tasks(); ++task) {
    const std::vector<uint32_t>& tiles = frame.task_tiles[static_cast<size_t>(task)];
    std::copy(tiles.begin(), tiles.end(), frame.tile_of_instance.data() + base);
    const int end = std::min((task + 1) * kBlocksPerTask, frame.num_ranks());
    for (int rank = task * kBlocksPerTask; rank < end; ++rank) {
      const size_t slot = static_cast<size_t>(rank) * kBlockSize;
      for (uint64_t rest = frame.visible[static_cast<size_t>(rank)]; rest != 0; rest &= rest - 1)
        frame.instances[slot + static_cast<size_t>(std::countr_zero(rest))].first += base;
    }
    base += static_cast<uint32_t>(tiles.size());
  }
}

constexpr int kDigitBits = 11;
constexpr size_t kDigits = size_t{1} << kDigitBits;
constexpr int kPasses = 3;

/// Keys (depth bits << 32 | slot) of the visible gaussians in slot order, and the histogram of every digit.
void gather_keys(Frame& frame, std::array<std::array<uint32_t, kDigits>, kPasses>& histograms) {
  int count = 0;
  for (uint64_t mask : frame.visible) count += std::popcount(mask);
  frame.num_visible = count;
  frame.sort_keys.reserve(static_cast<size_t>(count));
  frame.sort_scratch.reserve(static_cast<size_t>(count));
  uint64_t* out = frame.sort_keys.data();
  for (size_t rank = 0; rank < frame.visible.size(); ++rank)
    for (uint64_t rest = frame.visible[rank]; rest != 0; rest &= rest - 1) {
      const size_t slot = rank * kBlockSize + static_cast<size_t>(std::countr_zero(rest));
      const uint32_t depth = std::bit_cast<uint32_t>(frame.splats[slot].z);  // positive: ordered like the float
      *out++ = (uint64_t{depth} << 32) | slot;
      for (int pass = 0; pass < kPasses; ++pass)
        ++histograms[static_cast<size_t>(pass)][(depth >> (pass * kDigitBits)) & (kDigits - 1)];
    }
}

/// Least-significant-digit radix sort; stable, so equal depths stay in slot order.
void sort_by_depth(Frame& frame) {
  std::array<std::array<uint32_t, kDigits>, kPasses> histograms{};
  gather_keys(frame, histograms);
  const size_t count = static_cast<size_t>(frame.num_visible);
  for (int pass = 0; pass < kPasses; ++pass) {
    auto& histogram = histograms[static_cast<size_t>(pass)];
    uint32_t sum = 0;
    bool one_digit = false;
    for (uint32_t& bin : histogram) {
      one_digit = one_digit || bin == count;
      sum += std::exchange(bin, sum);
    }
    if (one_digit) continue;
    const int shift = 32 + pass * kDigitBits;
    const uint64_t* from = frame.sort_keys.data();
    uint64_t* to = frame.sort_scratch.data();
    for (size_t i = 0; i < count; ++i) to[histogram[(from[i] >> shift) & (kDigits - 1)]++] = from[i];
    std::swap(frame.sort_keys, frame.sort_scratch);
  }
}

void distribute_to_tiles(Frame& frame) {
  frame.entries.reserve(frame.num_instances);
  frame.cell_masks.reserve(frame.num_instances);
  frame.tile_begin.assign(static_cast<size_t>(frame.num_tiles()) + 1, 0);
  uint32_t* const begin = frame.tile_begin.data();
  for (uint32_t i = 0; i < frame.num_instances; ++i) ++begin[frame.tile_of_instance[i] + 1];
  for (int tile = 0; tile < frame.num_tiles(); ++tile) begin[tile + 1] += begin[tile];
  std::vector<uint32_t> cursor(frame.tile_begin);
  constexpr size_t kAhead = 16;
  const size_t count = static_cast<size_t>(frame.num_visible);
  for (size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) {
      const uint32_t next = static_cast<uint32_t>(frame.sort_keys[i + kAhead]);
      __builtin_prefetch(&frame.instances[next]);
    }
    const uint32_t slot = static_cast<uint32_t>(frame.sort_keys[i]);
    const InstanceRange range = frame.instances[slot];
    for (uint32_t k = range.first; k < range.first + range.count; ++k)
      frame.entries[cursor[frame.tile_of_instance[k]]++] = {slot, k};
  }
}

}  // namespace

void sort_frame(Frame& frame) {
  number_instances(frame);
  sort_by_depth(frame);
  distribute_to_tiles(frame);
}

}  // namespace photoslam::splatting
