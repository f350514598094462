// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "splatting/gaussian.h"

namespace photoslam {
class Archive;
}

namespace photoslam::splatting {

inline constexpr int kBlockSize = 64;

/// What the trainer learnt about one gaussian since the last reset.
struct Statistics {
  /// Σ over training views of |dL/d(screen position)|, the position in units of half the image width and height
  /// (as 3DGS measures it: independent of resolution). Divide by `visible` for the densification criterion.
  float gradient = 0;
  float weight = 0;      ///< Σ over views and pixels of the blending weight α T.
  float max_weight = 0;  ///< Largest blending weight in any pixel of any view.
  float visible = 0;     ///< Number of training views in which it touched a tile.
};

/// 64 gaussians of one anchor, one row per parameter: the unit of culling, projection and optimisation.
/// Lanes from `count` on hold zeros. Adam moments move along with the gaussians.
struct alignas(64) Block {
  float parameters[row::kCount][kBlockSize];
  float first_moments[row::kCount][kBlockSize];
  float second_moments[row::kCount][kBlockSize];
  float updates[kBlockSize];  ///< Optimiser steps taken (Adam's t).
  float gradient[kBlockSize];
  float weight[kBlockSize];
  float max_weight[kBlockSize];
  float visible[kBlockSize];
  uint32_t tags[kBlockSize];
  uint32_t births[kBlockSize];
  uint32_t origins[kBlockSize];  ///< Slot + 1 in the remote copy as of the last exchange; 0: the host has the values.
  int32_t anchor;
  int32_t count;
  float center[3];  ///< Bounding sphere of the sane means, in the anchor frame [m].
  float radius;     ///< [m]
  float max_scale;  ///< Largest standard deviation in the block [m].
};

/// Rows of a block as one table of 64 columns: parameters, moments and step counts, statistics.
namespace row {
inline constexpr int kOptimizer = kCount;
inline constexpr int kStatistics = 3 * kCount + 1;
inline constexpr int kTableRows = kStatistics + 4;
}  // namespace row

/// Row r, lane i of that table: table(block)[64 r + i].
inline const float* table(const Block& block) { return reinterpret_cast<const float*>(&block); }
inline float* table(Block& block) { return reinterpret_cast<float*>(&block); }

class GaussianModel;
struct Child;
struct DensityRules;

/// What becomes of a gaussian.
enum class Fate : uint8_t { stays, goes, clones, splits };

/// The values of a model on a GPU.
class RemoteModel {
 public:
  virtual ~RemoteModel() = default;
  /// Rows [first, first + count) of the table of every block: [blocks, count, 64]; false: they are lost.
  virtual bool fetch(int first_row, int num_rows, float* rows) = 0;

  // The following make the copy like the model before; false or nothing: that has failed.

  /// See GaussianModel::judge().
  virtual bool judge(const GaussianModel& model, const DensityRules& rules, std::span<Fate> fates) = 0;
  /// Writes children to new blocks behind those of the model, and says in which slot they begin.
  virtual std::optional<size_t> breed(const GaussianModel& model, std::span<const Child> children) = 0;
};

/// What a remote copy has to do to become like the model.
struct ModelChanges {
  static constexpr uint32_t kFromHost = 0x80000000u, kFromNowhere = 0xffffffffu;
  std::vector<uint32_t> sources;  ///< [blocks, 64] Slot of the copy, kFromHost + index of a record, or kFromNowhere.
  std::vector<int32_t> anchors, counts;  // [blocks]
  std::vector<float> records;            // [records, row::kTableRows]
  bool moves = false;                    ///< Some gaussian's slot is another than in the copy.
  bool clear_statistics = false;
};

/// The gaussians of a map, grouped by the anchor (keyframe) in whose frame they live.
///
/// A gaussian is addressed by its index = 64 * block + lane; indices stay valid until remove(). The order is
/// deterministic: blocks in order of creation, gaussians of an anchor in order of insertion.
class GaussianModel {
 public:
  GaussianModel();
  ~GaussianModel();
  GaussianModel(GaussianModel&&) noexcept;
  GaussianModel& operator=(GaussianModel&&) noexcept;

  /// Registers one more anchor and returns its index (0, 1, …).
  int add_anchor();
  int num_anchors() const { return static_cast<int>(blocks_of_anchor_.size()); }

  /// Appends gaussians to an anchor. `tag` is free for the caller, `birth` likewise (an iteration).
  /// The optimiser state and the statistics of the newcomers are zero. Returns the index of each newcomer.
  std::vector<size_t> add(int anchor, std::span<const Gaussian> gaussians, uint32_t tag = 0, uint32_t birth = 0);

  /// Adds all of another model, its anchors counted on from those of this one.
  void append(const GaussianModel& other);

  /// Number of gaussians.
  size_t size() const { return size_; }
  /// Number of gaussians of one anchor.
  size_t size(int anchor) const;
  bool empty() const { return size_ == 0; }

  size_t num_blocks() const { return blocks_.size(); }
  /// One past the largest index: 64 * num_blocks().
  size_t index_end() const { return blocks_.size() * kBlockSize; }
  const Block& block(size_t i) const {
    if (remote_) fetch(kAll);
    return *blocks_[i];
  }
  /// Whoever changes means or scales through this calls update_bounds(i) afterwards.
  Block& block(size_t i) {
    if (remote_) claim(i);
    return *blocks_[i];
  }
  void update_bounds(size_t block);

  /// Is there a gaussian at this index (lanes of partial blocks are not)?
  bool contains(size_t index) const;
  int anchor(size_t index) const { return blocks_[index / kBlockSize]->anchor; }
  Gaussian get(size_t index) const;
  /// Replaces the parameters; keeps optimiser state and statistics.
  void set(size_t index, const Gaussian& gaussian);
  /// Sets the Adam moments and step count of a gaussian to zero.
  void reset_optimizer(size_t index);

  Statistics statistics(size_t index) const;
  void reset_statistics();
  uint32_t tag(size_t index) const { return blocks_[index / kBlockSize]->tags[index % kBlockSize]; }
  void set_tag(size_t index, uint32_t tag) { blocks_[index / kBlockSize]->tags[index % kBlockSize] = tag; }
  uint32_t birth(size_t index) const { return blocks_[index / kBlockSize]->births[index % kBlockSize]; }

  /// Calls visit(index) for every gaussian, in order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (size_t b = 0; b < blocks_.size(); ++b)
      for (int lane = 0; lane < blocks_[b]->count; ++lane) visit(b * kBlockSize + static_cast<size_t>(lane));
  }

  /// Removes the gaussians for which the predicate holds and closes the gaps inside each anchor's blocks, keeping the
  /// order; empty blocks disappear. Returns how many were removed. All indices change.
  size_t remove_if(const std::function<bool(size_t index)>& predicate);
  /// The same with a mask over indices [0, index_end()): nonzero = remove.
  size_t remove(std::span<const uint8_t> mask);

  /// What the rules say of each gaussian: [index_end()].
  std::vector<Fate> judge(const DensityRules& rules) const;
  /// Lets it happen. Clones and halves go to the anchor of their parent, in order of the parents, with its tag but no
  /// past; the parent of two halves goes. `normals` holds six standard normal numbers per split. All indices change.
  void breed(std::span<const Fate> fates, std::span<const double> normals);

  /// Multiplies means and scales of an anchor's gaussians (a mono scale correction).
  void rescale_anchor(int anchor, float factor);

  /// Reorders the gaussians of every anchor along a space-filling curve so that blocks are compact in space.
  /// All indices change; statistics, optimiser state and tags move along.
  void sort_spatially();

  /// Writes gaussians, optimiser state and statistics, or replaces them by those read.
  void serialize(Archive& archive);

  /// Degree of the spherical harmonics in use, [0, 3]; higher coefficients are neither read nor trained.
  int sh_degree() const { return sh_degree_; }
  void set_sh_degree(int degree);

  // While a GPU trains or draws the model, the newest values are there. Every function above fetches what it needs,
  // once until the next iteration, so a model that has a remote copy is for one thread only.

  /// Takes a copy that holds nothing yet.
  void attach(std::shared_ptr<RemoteModel> remote) const;
  const RemoteModel* remote() const { return remote_.get(); }
  /// What the copy has to do; nothing: it is like the model. Call exchanged() when it is done.
  std::optional<ModelChanges> changes() const;
  void exchanged() const;
  /// The copy's values are newer now.
  void trained_remotely() { current_ = 0; }
  /// Fetches everything and forgets the copy. Values that are lost there are those fetched last.
  void bring_home() const;

 private:
  enum Part { kParameters = 1, kOptimizer = 2, kStatistics = 4, kAll = 7 };

  Block& append_block(int anchor);
  Gaussian read(size_t index) const;
  void fetch(int parts) const;
  void fetch_rows(int first_row, int num_rows) const;
  void forget_remote() const;
  void claim(size_t block);
  void renew_bounds(size_t block) const;

  std::vector<std::unique_ptr<Block>> blocks_;
  std::vector<std::vector<uint32_t>> blocks_of_anchor_;
  size_t size_ = 0;
  int sh_degree_ = kMaxShDegree;

  // Values and their remote copy are one thing in two places: a const model may fetch them.
  mutable std::shared_ptr<RemoteModel> remote_;
  mutable size_t remote_blocks_ = 0;
  mutable int current_ = kAll;  // parts whose values are also here
  mutable bool changed_ = false;
  mutable bool statistics_reset_ = false;
};

}  // namespace photoslam::splatting
