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

/// First instance of every projection task; the visible gaussians.
void number_instances(Frame& frame) {
  uint64_t total = 0;
  frame.task_begin.resize(static_cast<size_t>(frame.num_tasks()));
  for (size_t task = 0; task < frame.task_begin.size(); ++task) {
    frame.task_begin[task] = static_cast<uint32_t>(total);
    total += frame.task_tiles[task].size();
    PHOTOSLAM_CHECK(total < std::numeric_limits<uint32_t>::max(), "{} (gaussian, tile) pairs in one view", total);
  }
  frame.num_instances = static_cast<uint32_t>(total);
  frame.num_visible = 0;
  for (uint64_t mask : frame.visible) frame.num_visible += std::popcount(mask);
}

constexpr int kDigitBits = 8;
constexpr size_t kDigits = size_t{1} << kDigitBits;
constexpr size_t kPasses = 4;

/// Least-significant-digit radix sort by the upper 32 bits; stable. Digits that all keys share cost no pass.
void sort_keys(std::vector<uint64_t>& keys, std::vector<uint64_t>& scratch) {
  std::array<std::array<uint32_t, kDigits>, kPasses> histograms{};
  for (const uint64_t key : keys)
    for (size_t pass = 0; pass < kPasses; ++pass) ++histograms[pass][(key >> (32 + pass * kDigitBits)) & (kDigits - 1)];
  scratch.resize(keys.size());
  for (size_t pass = 0; pass < kPasses; ++pass) {
    auto& histogram = histograms[pass];
    const size_t shift = 32 + pass * kDigitBits;
    if (histogram[(keys[0] >> shift) & (kDigits - 1)] == keys.size()) continue;
    uint32_t sum = 0;
    for (uint32_t& bin : histogram) sum += std::exchange(bin, sum);
    for (const uint64_t key : keys) scratch[histogram[(key >> shift) & (kDigits - 1)]++] = key;
    std::swap(keys, scratch);
  }
}

}  // namespace

void distribute_to_tiles(Frame& frame) {
  number_instances(frame);
  frame.entries.reserve(frame.num_instances);
  frame.cell_masks.reserve(frame.num_instances);
  frame.tile_begin.assign(static_cast<size_t>(frame.num_tiles()) + 1, 0);
  uint32_t* const begin = frame.tile_begin.data();
  for (size_t task = 0; task < frame.task_begin.size(); ++task)
    for (const uint32_t tile : frame.task_tiles[task]) ++begin[tile + 1];
  for (int tile = 0; tile < frame.num_tiles(); ++tile) begin[tile + 1] += begin[tile];
  std::vector<uint32_t> cursor(frame.tile_begin);
  for (size_t rank = 0; rank < frame.visible.size(); ++rank) {
    const uint32_t* const tiles = frame.task_tiles[rank / kBlocksPerTask].data();
    const uint32_t first_instance = frame.task_begin[rank / kBlocksPerTask];
    for (uint64_t rest = frame.visible[rank]; rest != 0; rest &= rest - 1) {
      const size_t slot = rank * kBlockSize + static_cast<size_t>(std::countr_zero(rest));
      const InstanceRange range = frame.instances[slot];
      for (uint32_t k = range.first; k < range.first + range.count; ++k)
        frame.entries[cursor[tiles[k]]++] = {static_cast<uint32_t>(slot), first_instance + k};
    }
  }
}

void sort_tile(Frame& frame, int tile, TileSorter& sorter) {
  TileEntry* const entries = frame.entries.data() + frame.tile_begin[static_cast<size_t>(tile)];
  const size_t count = frame.tile_begin[static_cast<size_t>(tile) + 1] - frame.tile_begin[static_cast<size_t>(tile)];
  if (count < 2) return;
  constexpr size_t kAhead = 16;
  sorter.keys.resize(count);
  for (size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) __builtin_prefetch(&frame.splats[entries[i + kAhead].slot].z);
    const uint32_t depth = std::bit_cast<uint32_t>(frame.splats[entries[i].slot].z);  // positive: ordered as the float
    sorter.keys[i] = (uint64_t{depth} << 32) | i;
  }
  sort_keys(sorter.keys, sorter.scratch);
  sorter.unsorted.assign(entries, entries + count);
  for (size_t i = 0; i < count; ++i) entries[i] = sorter.unsorted[static_cast<uint32_t>(sorter.keys[i])];
}

}  // namespace photoslam::splatting
