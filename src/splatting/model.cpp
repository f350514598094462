// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/model.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/archive.h"
#include "base/check.h"

namespace photoslam::splatting {
namespace {

/// Calls f(row) for every row of per-gaussian data of a block but its origins, whatever its type.
template <class BlockType, class F>
void for_each_row(BlockType& block, F&& f) {
  for (auto& values : block.parameters) f(values);
  for (auto& values : block.first_moments) f(values);
  for (auto& values : block.second_moments) f(values);
  f(block.updates);
  f(block.gradient);
  f(block.weight);
  f(block.max_weight);
  f(block.visible);
  f(block.tags);
  f(block.births);
}

constexpr int kWords = 3 * row::kCount + 8;  // of one gaussian, all rows

/// One gaussian with everything that belongs to it, as 32-bit words.
using Record = std::array<uint32_t, kWords>;

Record take(const Block& block, int lane) {
  Record record;
  size_t i = 0;
  for_each_row(block, [&](const auto& values) { record[i++] = std::bit_cast<uint32_t>(values[lane]); });
  record[i] = block.origins[lane];
  return record;
}

void put(Block& block, int lane, const Record& record) {
  size_t i = 0;
  for_each_row(block, [&](auto& values) {
    values[lane] = std::bit_cast<std::remove_reference_t<decltype(values[lane])>>(record[i++]);
  });
  block.origins[lane] = record[i];
}

void clear_lane(Block& block, int lane) { put(block, lane, Record{}); }

void write_parameters(Block& block, int lane, const Gaussian& g) {
  for (int i = 0; i < 3; ++i) block.parameters[row::kMean + i][lane] = g.mean[i];
  for (int i = 0; i < 4; ++i) block.parameters[row::kRotation + i][lane] = g.rotation[i];
  for (int i = 0; i < 3; ++i) block.parameters[row::kLogScale + i][lane] = g.log_scale[i];
  block.parameters[row::kOpacity][lane] = g.opacity_logit;
  for (int k = 0; k < kNumShCoefficients; ++k)
    for (int c = 0; c < 3; ++c) block.parameters[row::kSh + 3 * k + c][lane] = g.sh[k][c];
}

/// Interleaves the low 21 bits of three numbers.
uint64_t morton_code(const std::array<uint32_t, 3>& cell) {
  uint64_t code = 0;
  for (int bit = 20; bit >= 0; --bit)
    for (uint32_t axis : cell) code = (code << 1) | ((axis >> bit) & 1);
  return code;
}

}  // namespace

GaussianModel::GaussianModel() = default;
GaussianModel::~GaussianModel() = default;
GaussianModel::GaussianModel(GaussianModel&&) noexcept = default;
GaussianModel& GaussianModel::operator=(GaussianModel&&) noexcept = default;

int GaussianModel::add_anchor() {
  blocks_of_anchor_.emplace_back();
  return num_anchors() - 1;
}

Block& GaussianModel::append_block(int anchor) {
  blocks_of_anchor_[static_cast<size_t>(anchor)].push_back(static_cast<uint32_t>(blocks_.size()));
  blocks_.push_back(std::make_unique<Block>(Block{}));
  blocks_.back()->anchor = anchor;
  return *blocks_.back();
}

void GaussianModel::append(const GaussianModel& other) {
  bring_home();
  other.bring_home();
  const int num_own = num_anchors();
  for (int i = 0; i < other.num_anchors(); ++i) add_anchor();
  for (const auto& block : other.blocks_) {
    const int anchor = num_own + block->anchor;
    Block& copy = append_block(anchor);
    copy = *block;
    copy.anchor = anchor;
  }
  size_ += other.size_;
}

std::vector<size_t> GaussianModel::add(int anchor, std::span<const Gaussian> gaussians, uint32_t tag, uint32_t birth) {
  PHOTOSLAM_CHECK(anchor >= 0 && anchor < num_anchors(), "anchor {} of {}", anchor, num_anchors());
  std::vector<size_t> indices;
  indices.reserve(gaussians.size());
  const std::vector<uint32_t>& own = blocks_of_anchor_[static_cast<size_t>(anchor)];
  for (const Gaussian& gaussian : gaussians) {
    if (own.empty() || blocks_[own.back()]->count == kBlockSize) {
      if (!indices.empty()) update_bounds(own.back());
      append_block(anchor);
    }
    Block& block = *blocks_[own.back()];
    const int lane = block.count++;
    write_parameters(block, lane, gaussian);
    block.tags[lane] = tag;
    block.births[lane] = birth;
    indices.push_back(size_t{own.back()} * kBlockSize + static_cast<size_t>(lane));
  }
  if (!indices.empty()) update_bounds(own.back());
  size_ += gaussians.size();
  changed_ = true;
  return indices;
}

size_t GaussianModel::size(int anchor) const {
  size_t count = 0;
  for (uint32_t b : blocks_of_anchor_[static_cast<size_t>(anchor)]) count += static_cast<size_t>(blocks_[b]->count);
  return count;
}

void GaussianModel::update_bounds(size_t index) { renew_bounds(index); }

void GaussianModel::renew_bounds(size_t index) const {
  // Column-wise over the rows, kColumns at a time: compilers turn that into vectors.
  constexpr int kColumns = 16;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Block& block = *blocks_[index];
  float radius2 = 0;
  for (int i = 0; i < 3; ++i) {
    float lows[kColumns], highs[kColumns];
    std::fill_n(lows, kColumns, kInfinity);
    std::fill_n(highs, kColumns, -kInfinity);
    const float* means = block.parameters[row::kMean + i];
    for (int first = 0; first < kBlockSize; first += kColumns)
      for (int k = 0; k < kColumns; ++k) {
        const float x = means[first + k];
        const bool sane = (first + k < block.count) & (std::abs(x) < kAbsurd);
        const float low = sane ? x : kInfinity, high = sane ? x : -kInfinity;
        lows[k] = low < lows[k] ? low : lows[k];
        highs[k] = high > highs[k] ? high : highs[k];
      }
    const float low = *std::min_element(lows, lows + kColumns), high = *std::max_element(highs, highs + kColumns);
    block.center[i] = low <= high ? 0.5f * low + 0.5f * high : 0.0f;
    radius2 += low <= high ? (high - block.center[i]) * (high - block.center[i]) : 0.0f;
  }
  float scales[kColumns];
  std::fill_n(scales, kColumns, -kInfinity);
  for (int i = 0; i < 3; ++i)
    for (int first = 0; first < kBlockSize; first += kColumns)
      for (int k = 0; k < kColumns; ++k) {
        const float x = block.parameters[row::kLogScale + i][first + k];
        const float scale = first + k < block.count ? x : -kInfinity;
        scales[k] = scale > scales[k] ? scale : scales[k];
      }
  const float log_scale = *std::max_element(scales, scales + kColumns);
  block.radius = std::sqrt(radius2);
  block.max_scale = std::exp(std::min(log_scale, 80.0f));
}

bool GaussianModel::contains(size_t index) const {
  const size_t b = index / kBlockSize;
  return b < blocks_.size() && static_cast<int>(index % kBlockSize) < blocks_[b]->count;
}

Gaussian GaussianModel::get(size_t index) const {
  fetch(kParameters);
  return read(index);
}

/// The values that are here.
Gaussian GaussianModel::read(size_t index) const {
  const Block& block = *blocks_[index / kBlockSize];
  const size_t lane = index % kBlockSize;
  Gaussian g;
  for (int i = 0; i < 3; ++i) g.mean[i] = block.parameters[row::kMean + i][lane];
  for (int i = 0; i < 4; ++i) g.rotation[i] = block.parameters[row::kRotation + i][lane];
  for (int i = 0; i < 3; ++i) g.log_scale[i] = block.parameters[row::kLogScale + i][lane];
  g.opacity_logit = block.parameters[row::kOpacity][lane];
  for (int k = 0; k < kNumShCoefficients; ++k)
    for (int c = 0; c < 3; ++c) g.sh[k][c] = block.parameters[row::kSh + 3 * k + c][lane];
  return g;
}

void GaussianModel::set(size_t index, const Gaussian& gaussian) {
  PHOTOSLAM_CHECK(contains(index), "no gaussian at index {}", index);
  write_parameters(block(index / kBlockSize), static_cast<int>(index % kBlockSize), gaussian);
  update_bounds(index / kBlockSize);
}

void GaussianModel::reset_optimizer(size_t index) {
  Block& block = this->block(index / kBlockSize);
  const size_t lane = index % kBlockSize;
  for (auto& values : block.first_moments) values[lane] = 0;
  for (auto& values : block.second_moments) values[lane] = 0;
  block.updates[lane] = 0;
}

Statistics GaussianModel::statistics(size_t index) const {
  fetch(kStatistics);
  const Block& block = *blocks_[index / kBlockSize];
  const size_t lane = index % kBlockSize;
  return {block.gradient[lane], block.weight[lane], block.max_weight[lane], block.visible[lane]};
}

void GaussianModel::reset_statistics() {
  for (const auto& block : blocks_)
    for (auto* values : {block->gradient, block->weight, block->max_weight, block->visible})
      std::fill_n(values, kBlockSize, 0.0f);
  if (!remote_) return;
  current_ |= kStatistics;
  changed_ = statistics_reset_ = true;
}

size_t GaussianModel::remove_if(const std::function<bool(size_t)>& predicate) {
  size_t removed = 0;
  for (std::vector<uint32_t>& own : blocks_of_anchor_) {
    size_t to = 0;  // gaussians kept so far: they fill the anchor's blocks from the front
    for (uint32_t b : own)
      for (int lane = 0; lane < blocks_[b]->count; ++lane) {
        if (predicate(size_t{b} * kBlockSize + static_cast<size_t>(lane))) {
          ++removed;
          continue;
        }
        Block& target = *blocks_[own[to / kBlockSize]];
        const int target_lane = static_cast<int>(to % kBlockSize);
        if (&target != blocks_[b].get() || target_lane != lane) put(target, target_lane, take(*blocks_[b], lane));
        ++to;
      }
    for (size_t i = 0; i < own.size(); ++i) {
      Block& block = *blocks_[own[i]];
      const size_t kept = to > i * kBlockSize ? std::min<size_t>(to - i * kBlockSize, kBlockSize) : 0;
      for (int lane = static_cast<int>(kept); lane < block.count; ++lane) clear_lane(block, lane);
      if (static_cast<int>(kept) != block.count || removed > 0) {
        block.count = static_cast<int>(kept);
        update_bounds(own[i]);
      }
    }
  }
  size_ -= removed;
  changed_ = changed_ || removed > 0;

  std::vector<std::unique_ptr<Block>> kept;
  for (std::vector<uint32_t>& own : blocks_of_anchor_) own.clear();
  for (auto& block : blocks_) {
    if (block->count == 0) continue;
    blocks_of_anchor_[static_cast<size_t>(block->anchor)].push_back(static_cast<uint32_t>(kept.size()));
    kept.push_back(std::move(block));
  }
  blocks_ = std::move(kept);
  return removed;
}

size_t GaussianModel::remove(std::span<const uint8_t> mask) {
  PHOTOSLAM_CHECK(mask.size() == index_end(), "mask of {} for {} indices", mask.size(), index_end());
  return remove_if([&](size_t index) { return mask[index] != 0; });
}

void GaussianModel::rescale_anchor(int anchor, float factor) {
  PHOTOSLAM_CHECK(factor > 0, "factor {}", factor);
  const float log_factor = std::log(factor);
  for (uint32_t b : blocks_of_anchor_[static_cast<size_t>(anchor)]) {
    Block& block = this->block(b);
    for (int lane = 0; lane < block.count; ++lane) {
      for (int i = 0; i < 3; ++i) block.parameters[row::kMean + i][lane] *= factor;
      for (int i = 0; i < 3; ++i) block.parameters[row::kLogScale + i][lane] += log_factor;
      // Gradients by the mean shrink as lengths grow, and what the optimiser remembers of them does as well.
      for (int i = 0; i < 3; ++i) block.first_moments[row::kMean + i][lane] /= factor;
      for (int i = 0; i < 3; ++i) block.second_moments[row::kMean + i][lane] /= factor * factor;
    }
    update_bounds(b);
  }
}

void GaussianModel::sort_spatially() {
  fetch(kParameters);
  changed_ = true;
  for (const std::vector<uint32_t>& own : blocks_of_anchor_) {
    float low[3], high[3];
    std::fill_n(low, 3, std::numeric_limits<float>::infinity());
    std::fill_n(high, 3, -std::numeric_limits<float>::infinity());
    for (uint32_t b : own)
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], blocks_[b]->center[i] - blocks_[b]->radius);
        high[i] = std::max(high[i], blocks_[b]->center[i] + blocks_[b]->radius);
      }
    std::vector<std::pair<uint64_t, uint32_t>> order;
    for (uint32_t b : own)
      for (int lane = 0; lane < blocks_[b]->count; ++lane) {
        std::array<uint32_t, 3> cell{};
        for (size_t i = 0; i < 3; ++i) {
          const float at = (blocks_[b]->parameters[row::kMean + i][lane] - low[i]) / (high[i] - low[i]);
          cell[i] = at > 0 ? static_cast<uint32_t>(std::min(at, 1.0f) * 2097151.0f) : 0;  // not a number: 0
        }
        order.emplace_back(morton_code(cell), static_cast<uint32_t>(order.size()));
      }
    std::sort(order.begin(), order.end());
    const auto take_nth = [&](size_t n) {
      return take(*blocks_[own[n / kBlockSize]], static_cast<int>(n % kBlockSize));
    };
    const auto put_nth = [&](size_t n, const Record& record) {
      put(*blocks_[own[n / kBlockSize]], static_cast<int>(n % kBlockSize), record);
    };
    // Follows the cycles of the permutation, so that only one gaussian needs a second home.
    constexpr uint32_t kDone = std::numeric_limits<uint32_t>::max();
    for (size_t start = 0; start < order.size(); ++start) {
      if (order[start].second == kDone) continue;
      const Record first = take_nth(start);
      size_t to = start;
      while (true) {
        const size_t from = std::exchange(order[to].second, kDone);
        if (from == start) break;
        put_nth(to, take_nth(from));
        to = from;
      }
      put_nth(to, first);
    }
    for (uint32_t b : own) update_bounds(b);
  }
}

void GaussianModel::set_sh_degree(int degree) {
  PHOTOSLAM_CHECK(degree >= 0 && degree <= kMaxShDegree, "degree {}", degree);
  sh_degree_ = degree;
}

void GaussianModel::serialize(Archive& a) {
  if (a.reading()) {
    forget_remote();
  } else {
    fetch(kAll);
  }
  uint64_t num_anchors = blocks_of_anchor_.size(), num_blocks = blocks_.size();
  a(sh_degree_, num_anchors, num_blocks);
  if (a.reading()) {
    blocks_of_anchor_.assign(num_anchors, {});
    blocks_.clear();
    size_ = 0;
  }
  for (uint64_t b = 0; b < num_blocks; ++b) {
    if (a.reading()) blocks_.push_back(std::make_unique<Block>(Block{}));
    Block& block = *blocks_[b];
    a(block.anchor, block.count);
    PHOTOSLAM_CHECK(block.anchor >= 0 && block.anchor < static_cast<int32_t>(num_anchors) && block.count >= 0 &&
                        block.count <= kBlockSize,
                    "anchor {}, count {}", block.anchor, block.count);
    for (float& c : block.center) a(c);
    a(block.radius, block.max_scale);
    for_each_row(block, [&](auto& values) {
      // Whole rows are zero where spherical harmonics of higher degree are not in use.
      uint8_t is_used = std::any_of(values, values + block.count, [](auto v) { return v != 0; }) ? 1 : 0;
      a(is_used);
      if (is_used != 0) a.raw(values, sizeof(values[0]) * static_cast<size_t>(block.count));
    });
    if (!a.reading()) continue;
    blocks_of_anchor_[static_cast<size_t>(block.anchor)].push_back(static_cast<uint32_t>(b));
    size_ += static_cast<size_t>(block.count);
  }
}

static_assert(offsetof(Block, first_moments) == sizeof(float) * kBlockSize * row::kOptimizer);
static_assert(offsetof(Block, gradient) == sizeof(float) * kBlockSize * row::kStatistics);
static_assert(offsetof(Block, tags) == sizeof(float) * kBlockSize * row::kTableRows);

void GaussianModel::fetch_rows(int first_row, int num_rows) const {
  const auto rows = static_cast<size_t>(num_rows);
  std::vector<float> fetched(remote_blocks_ * rows * kBlockSize);
  if (!remote_->fetch(first_row, num_rows, fetched.data())) return forget_remote();
  for (const auto& block : blocks_) {
    float* const to = table(*block) + first_row * kBlockSize;
    for (int lane = 0; lane < block->count; ++lane) {
      if (block->origins[lane] == 0) continue;
      const size_t slot = block->origins[lane] - 1;
      const float* from = &fetched[slot / kBlockSize * rows * kBlockSize + slot % kBlockSize];
      for (size_t r = 0; r < rows; ++r) to[r * kBlockSize + static_cast<size_t>(lane)] = from[r * kBlockSize];
    }
  }
}

void GaussianModel::fetch(int parts) const {
  if (!remote_) return;
  const int missing = parts & ~current_;
  current_ |= missing;
  if ((missing & kParameters) != 0) fetch_rows(0, row::kOptimizer);
  if (remote_ && (missing & kOptimizer) != 0) fetch_rows(row::kOptimizer, row::kStatistics - row::kOptimizer);
  if (remote_ && (missing & kStatistics) != 0) fetch_rows(row::kStatistics, row::kTableRows - row::kStatistics);
  if ((missing & kParameters) == 0) return;
  for (size_t b = 0; b < blocks_.size(); ++b) renew_bounds(b);
}

/// From now on the values of this block are those of the host.
void GaussianModel::claim(size_t b) {
  fetch(kAll);
  std::fill_n(blocks_[b]->origins, kBlockSize, 0u);
  changed_ = true;
}

void GaussianModel::attach(std::shared_ptr<RemoteModel> remote) const {
  bring_home();
  remote_ = std::move(remote);
  remote_blocks_ = 0;
  changed_ = true;
}

void GaussianModel::bring_home() const {
  fetch(kAll);
  forget_remote();
}

void GaussianModel::forget_remote() const {
  for (const auto& block : blocks_) std::fill_n(block->origins, kBlockSize, 0u);
  remote_.reset();
  remote_blocks_ = 0;
  current_ = kAll;
  statistics_reset_ = false;
}

std::optional<ModelChanges> GaussianModel::changes() const {
  if (!changed_) return {};
  ModelChanges changes;
  changes.clear_statistics = statistics_reset_;
  changes.sources.assign(index_end(), ModelChanges::kFromNowhere);
  for (size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = *blocks_[b];
    changes.anchors.push_back(block.anchor);
    changes.counts.push_back(block.count);
    for (int lane = 0; lane < block.count; ++lane) {
      const size_t slot = b * kBlockSize + static_cast<size_t>(lane);
      if (block.origins[lane] != 0) {
        changes.sources[slot] = block.origins[lane] - 1;
        changes.moves = changes.moves || changes.sources[slot] != slot;
        continue;
      }
      changes.sources[slot] = ModelChanges::kFromHost + static_cast<uint32_t>(changes.records.size() / row::kTableRows);
      for (int r = 0; r < row::kTableRows; ++r) changes.records.push_back(table(block)[r * kBlockSize + lane]);
    }
  }
  return changes;
}

void GaussianModel::exchanged() const {
  for (size_t b = 0; b < blocks_.size(); ++b)
    for (int lane = 0; lane < blocks_[b]->count; ++lane)
      blocks_[b]->origins[lane] = static_cast<uint32_t>(b * kBlockSize + static_cast<size_t>(lane) + 1);
  remote_blocks_ = blocks_.size();
  changed_ = statistics_reset_ = false;
}

}  // namespace photoslam::splatting
