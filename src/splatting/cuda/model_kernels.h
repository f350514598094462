// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "splatting/cuda/project_kernels.h"
#include "splatting/density_formulas.h"

namespace photoslam::splatting::cuda {

/// Rearranges the model: one thread block per block of the new model, one thread per slot. `from` and `to` may be the
/// same when no slot moves: then what stays is not touched.
struct RearrangeKernel {
  static constexpr int kThreads = kBlockSize;
  using Shared = NoShared;
  const Block* from;
  Block* to;
  const uint32_t* sources;  ///< [slots]
  const int32_t* anchors;   ///< [blocks]
  const int32_t* counts;    ///< [blocks]
  const float* records;     ///< [records, row::kTableRows]

  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t rank = static_cast<uint32_t>(group.block()), lane = static_cast<uint32_t>(group.thread());
    const uint32_t slot = rank * kBlockSize + lane, source = sources[slot];
    Block& block = to[rank];
    if (lane == 0) {
      block.anchor = anchors[rank];
      block.count = counts[rank];
    }
    if (source == slot && from == to) return;
    float* out = &block.parameters[0][0] + lane;
    if (source == ModelChanges::kFromNowhere) {
      for (int r = 0; r < row::kTableRows; ++r) out[r * kBlockSize] = 0;
    } else if (source >= ModelChanges::kFromHost) {
      const float* record = records + size_t{source - ModelChanges::kFromHost} * row::kTableRows;
      for (int r = 0; r < row::kTableRows; ++r) out[r * kBlockSize] = record[r];
    } else {
      const float* in = &from[source / kBlockSize].parameters[0][0] + source % kBlockSize;
      for (int r = 0; r < row::kTableRows; ++r) out[r * kBlockSize] = in[r * kBlockSize];
    }
  }
};

/// One thread block per block of the model.
struct JudgeKernel {
  static constexpr int kThreads = kBlockSize;
  using Shared = NoShared;
  const Block* blocks;
  DensityRules rules;
  Fate* fates;  ///< [slots]
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const int lane = group.thread();
    const Block& block = blocks[group.block()];
    fates[group.block() * kBlockSize + lane] = lane < block.count ? judge(rules, block, lane) : Fate::stays;
  }
};

/// Writes children to the blocks from `first` on: one thread block per such block.
struct BreedKernel {
  static constexpr int kThreads = kBlockSize;
  using Shared = NoShared;
  Block* blocks;
  uint32_t first;
  const Child* children;
  uint32_t num_children;
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    const uint32_t lane = static_cast<uint32_t>(group.thread());
    const uint32_t k = static_cast<uint32_t>(group.block()) * kBlockSize + lane;
    Block& block = blocks[first + static_cast<uint32_t>(group.block())];
    if (lane == 0) block.anchor = block.count = 0;
    float* const out = &block.parameters[0][0] + lane;
    const int inherited = k < num_children ? row::kCount : 0;
    for (int r = inherited; r < row::kTableRows; ++r) out[r * kBlockSize] = 0;
    if (k >= num_children) return;
    const Child& child = children[k];
    const float* const in = &blocks[child.parent / kBlockSize].parameters[0][0] + child.parent % kBlockSize;
    for (int r = 0; r < row::kCount; ++r) out[r * kBlockSize] = in[r * kBlockSize];
    if (child.is_half != 0) halve(child.normals, out, kBlockSize);
  }
};

/// Sets the statistics of all gaussians to zero: one thread block per block of the model.
struct ClearStatistics {
  static constexpr int kThreads = kBlockSize;
  using Shared = NoShared;
  Block* blocks;
  template <class Group>
  PHOTOSLAM_DEVICE void operator()(Group& group, Shared&) const {
    Block& block = blocks[group.block()];
    const int lane = group.thread();
    block.gradient[lane] = block.weight[lane] = block.max_weight[lane] = block.visible[lane] = 0;
  }
};

}  // namespace photoslam::splatting::cuda
