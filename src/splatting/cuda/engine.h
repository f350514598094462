// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What runs in which order on a device. The device is a CudaDevice, or a HostDevice in tests: the same launches.

#include <algorithm>

#include "splatting/cuda/device_engine.h"
#include "splatting/cuda/device_sort.h"
#include "splatting/cuda/loss_kernels.h"
#include "splatting/cuda/model_kernels.h"
#include "splatting/cuda/target_cache.h"
#include "splatting/cuda/undistorter.h"
#include "splatting/cuda/update_kernel.h"

namespace photoslam::splatting::cuda {

/// What kernels report, on the device.
struct Results {
  uint32_t slots, visible, instances, lost, buckets, unused;
  double sums[3][kLossSums];
  double depth;
  double pose[6];
};

template <class Device>
class Engine final : public DeviceEngine {
 public:
  /// Numbers of 32 bits count the pixels of all buckets of so many instances.
  static constexpr uint32_t kMostInstances = 1u << 28;

  Engine(Device device, uint64_t memory_limit, uint32_t most_instances = kMostInstances)
      : device_(std::move(device)), memory_(device_, memory_limit), most_instances_(most_instances) {
    memory_.make_room = [this] { return targets_.drop_oldest(); };
    results_.reserve(1);
  }

  void arrange(const Arrangement& arrangement) override;
  void fetch(int first_row, int num_rows, float* rows) override {
    if (num_blocks_ == 0) return;
    device_.download_rows(rows, &blocks_.data()->parameters[0][0] + first_row * kBlockSize, sizeof(Block),
                          static_cast<size_t>(num_rows) * sizeof(float) * kBlockSize, num_blocks_);
  }
  void judge(const DensityRules& rules, Fate* fates) override;
  void breed(const Child* children, uint32_t count) override;
  Figures forward(const DeviceView& view, bool keep) override;
  void read_image(const ImagePlanes& image) override;
  Figures backward(const float* dl_drgb, const float* dl_ddepth, const float* dl_dalpha, float* dense) override;
  Figures step(const DeviceView& view, const DeviceTarget& target, const DeviceLoss& loss,
               const UpdateConstants& constants, bool update) override;
  void forget_target(uint64_t id) override { targets_.forget(id); }
  std::unique_ptr<DeviceUndistorter> make_undistorter(const DeviceLens* lenses, int count) override {
    using Sibling = decltype(device_.sibling(0));
    return std::make_unique<Undistorter<Sibling>>(device_.sibling(Undistorter<Sibling>::staging_bytes(lenses, count)),
                                                  memory_.budget(), lenses, count);
  }
  uint64_t peak_bytes() const override { return memory_.budget()->peak(); }

 private:
  template <class T>
  using Buffer = Array<T, Device>;
  using Target = typename TargetCache<Device>::Entry;
  enum Mark { kStart, kProjected, kSorted, kBlended, kCompared, kUnblended, kUpdated };

  static int blocks_for(size_t items, int threads) {
    return static_cast<int>((items + static_cast<size_t>(threads) - 1) / static_cast<size_t>(threads));
  }
  uint32_t num_slots() const { return num_blocks_ * kBlockSize; }
  size_t plane() const { return static_cast<size_t>(image_.width) * static_cast<size_t>(image_.height); }
  size_t num_tiles() const { return static_cast<size_t>(image_.tiles()); }
  TileLists lists() const {
    return {splats_.data(), tile_pairs_.values(), instance_slots_.data(), tile_begin_.data(), bucket_begin_.data()};
  }

  Buffer<Block> make_blocks(uint32_t count);
  void draw(const DeviceView& view, bool keep);
  void begin(const DeviceView& view);
  void project();
  void list_instances();
  void blend(bool keep);
  void compare(const Target& target, const DeviceLoss& loss);
  void compare_depth(const Target& target, float unit, float weight);
  void unblend(bool with_depth, bool with_alpha);
  void update_model(const UpdateConstants& constants, bool update, float* dense);
  Figures read_figures(Mark first, Mark last);
  void reserve_instances(bool keep);
  bool has_lost_too_many(const Figures& figures, bool keep);

  Device device_;
  Memory<Device> memory_;
  TargetCache<Device> targets_{device_, memory_};

  Buffer<Block> blocks_{memory_};
  uint32_t num_blocks_ = 0;

  // Of the view drawn last. "Slots": 64 per block of the model.
  Extent image_{0, 0};
  int sh_degree_ = 0;
  float background_[3] = {};
  Buffer<AnchorView> views_{memory_};
  Buffer<Results> results_{memory_};
  Buffer<Splat> splats_{memory_};                                                 // [slots]
  Pairs<Device> depth_pairs_{memory_};                                            // [slots] depth, slot
  Buffer<uint32_t> tiles_{memory_}, offsets_{memory_}, first_instance_{memory_};  // [slots]
  Buffer<uint32_t> prefix_rows_{memory_};
  Pairs<Device> tile_pairs_{memory_};         // [instances] tile, emitted position
  Buffer<uint32_t> instance_slots_{memory_};  // [instances]
  Buffer<SplatGradient> records_{memory_};    // [instances]
  Buffer<Checkpoint> checkpoints_{memory_};   // [buckets, kTilePixels]
  Buffer<uint32_t> tile_begin_{memory_}, bucket_begin_{memory_}, used_buckets_{memory_};
  Buffer<float> rgb_{memory_}, depth_{memory_}, alpha_{memory_};
  const uint32_t most_instances_;
  uint32_t capacity_ = 0;       // instances there is room for
  bool tolerate_lost_ = false;  // there will be no more room

  // Of the way back.
  Buffer<float> dl_drgb_{memory_}, dl_ddepth_{memory_}, dl_dalpha_{memory_};
  Buffer<float> ssim_derivatives_{memory_}, loss_sums_{memory_}, depth_sums_{memory_}, pose_{memory_}, dense_{memory_};
};

/// Blocks are copied as a whole, so all of them is initialised.
template <class Device>
Array<Block, Device> Engine<Device>::make_blocks(uint32_t count) {
  Buffer<Block> blocks(memory_);
  blocks.reserve(count);
  device_.clear(blocks.data(), blocks.size() * sizeof(Block));
  return blocks;
}

template <class Device>
void Engine<Device>::arrange(const Arrangement& a) {
  const size_t slots = size_t{a.num_blocks} * kBlockSize;
  Buffer<uint32_t> sources(memory_);
  Buffer<int32_t> anchors(memory_), counts(memory_);
  Buffer<float> records(memory_);
  Buffer<Block> target(memory_);
  sources.take(slots);
  anchors.take(a.num_blocks);
  counts.take(a.num_blocks);
  records.take(size_t{a.num_records} * row::kTableRows);
  const bool in_place = !a.moves && a.num_blocks <= blocks_.size();
  if (!in_place) target = make_blocks(a.num_blocks);
  device_.upload(sources.data(), a.sources, slots * sizeof(uint32_t));
  device_.upload(anchors.data(), a.anchors, a.num_blocks * sizeof(int32_t));
  device_.upload(counts.data(), a.counts, a.num_blocks * sizeof(int32_t));
  device_.upload(records.data(), a.records, size_t{a.num_records} * row::kTableRows * sizeof(float));
  Block* const to = in_place ? blocks_.data() : target.data();
  device_.launch(static_cast<int>(a.num_blocks),
                 RearrangeKernel{blocks_.data(), to, sources.data(), anchors.data(), counts.data(), records.data()});
  if (a.clear_statistics) device_.launch(static_cast<int>(a.num_blocks), ClearStatistics{to});
  if (!in_place) std::swap(blocks_, target);
  num_blocks_ = a.num_blocks;
}

template <class Device>
void Engine<Device>::judge(const DensityRules& rules, Fate* fates) {
  Buffer<Fate> on_device(memory_);
  on_device.take(num_slots());
  device_.launch(static_cast<int>(num_blocks_), JudgeKernel{blocks_.data(), rules, on_device.data()});
  device_.download(fates, on_device.data(), num_slots() * sizeof(Fate));
}

template <class Device>
void Engine<Device>::breed(const Child* children, uint32_t count) {
  const uint32_t added = static_cast<uint32_t>(blocks_for(count, kBlockSize));
  Buffer<Child> list(memory_);
  list.take(count);
  device_.upload(list.data(), children, count * sizeof(Child));
  if (num_blocks_ + added > blocks_.size()) {
    Buffer<Block> larger = make_blocks(num_blocks_ + added);
    device_.copy(larger.data(), blocks_.data(), num_blocks_ * sizeof(Block));
    std::swap(blocks_, larger);
  }
  device_.launch(static_cast<int>(added), BreedKernel{blocks_.data(), num_blocks_, list.data(), count});
  num_blocks_ += added;
}

template <class Device>
void Engine<Device>::begin(const DeviceView& view) {
  const size_t slots = num_slots();
  image_ = {view.width, view.height};
  sh_degree_ = view.sh_degree;
  std::copy_n(view.background, 3, background_);
  views_.reserve(std::max<size_t>(view.num_anchors, 1));
  splats_.reserve(slots);
  depth_pairs_.reserve(slots);
  tiles_.reserve(slots);
  first_instance_.reserve(slots);
  offsets_.reserve(padded_for_prefix(num_slots()));
  tile_begin_.reserve(num_tiles() + 1);
  bucket_begin_.reserve(padded_for_prefix(static_cast<uint32_t>(num_tiles())));
  used_buckets_.reserve(num_tiles());
  prefix_rows_.reserve(
      (std::max(padded_for_prefix(num_slots()), padded_for_prefix(static_cast<uint32_t>(num_tiles())))) /
      kPrefixColumns);
  rgb_.reserve(3 * plane());
  depth_.reserve(plane());
  alpha_.reserve(plane());
  constexpr uint32_t kLeast = 1024, kPerSlot = 6;
  if (capacity_ == 0) {
    const uint64_t guess = std::max<uint64_t>(kLeast, uint64_t{kPerSlot} * slots);
    capacity_ = static_cast<uint32_t>(std::min<uint64_t>(guess, most_instances_));
  }

  Results results{};
  results.slots = num_slots();
  device_.upload(results_.data(), &results, sizeof(results));
  device_.upload(views_.data(), view.anchors, view.num_anchors * sizeof(AnchorView));
}

/// Everything that grows with the number of instances; without the means for the way back unless `keep`.
template <class Device>
void Engine<Device>::reserve_instances(bool keep) {
  tile_pairs_.reserve(capacity_);
  instance_slots_.reserve(capacity_);
  if (!keep) return;
  records_.reserve(capacity_);
  checkpoints_.reserve((capacity_ / kWarpSize + num_tiles()) * kTilePixels);
}

template <class Device>
void Engine<Device>::project() {
  Results* const r = results_.data();
  device_.launch(blocks_for(num_slots(), ProjectKernel::kThreads),
                 ProjectKernel{blocks_.data(), num_slots(), views_.data(), image_, sh_degree_, splats_.data(),
                               depth_pairs_.keys(), depth_pairs_.values(), tiles_.data(), &r->visible});
}

template <class Device>
void Engine<Device>::list_instances() {
  Results* const r = results_.data();
  const uint32_t tiles = static_cast<uint32_t>(num_tiles()), slots = num_slots();
  depth_pairs_.sort(device_, &r->slots, slots, 32);
  device_.launch(blocks_for(padded_for_prefix(slots), GatherCounts::kThreads),
                 GatherCounts{depth_pairs_.values(), tiles_.data(), slots, padded_for_prefix(slots), offsets_.data()});
  prefix_sums(device_, offsets_.data(), slots, prefix_rows_.data(), &r->instances);
  device_.launch(
      blocks_for(slots, EmitInstances::kThreads),
      EmitInstances{depth_pairs_.values(), tiles_.data(), offsets_.data(), slots, splats_.data(), image_, capacity_,
                    tile_pairs_.keys(), tile_pairs_.values(), instance_slots_.data(), first_instance_.data()});
  device_.launch(1, BoundInstances{&r->instances, capacity_, &r->lost});
  int bits = 1;
  while ((tiles >> bits) != 0) ++bits;
  tile_pairs_.sort(device_, &r->instances, capacity_, bits);
  device_.launch(blocks_for(size_t{capacity_} + 1, FindTiles::kThreads),
                 FindTiles{tile_pairs_.keys(), &r->instances, tiles, tile_begin_.data()});
  device_.launch(blocks_for(padded_for_prefix(tiles), CountBuckets::kThreads),
                 CountBuckets{tile_begin_.data(), tiles, padded_for_prefix(tiles), bucket_begin_.data()});
  prefix_sums(device_, bucket_begin_.data(), tiles, prefix_rows_.data(), &r->buckets);
}

template <class Device>
void Engine<Device>::blend(bool keep) {
  BlendKernel kernel{.lists = lists(),
                     .image = image_,
                     .background = {background_[0], background_[1], background_[2]},
                     .checkpoints = keep ? checkpoints_.data() : nullptr,
                     .used_buckets = used_buckets_.data(),
                     .rgb = rgb_.data(),
                     .depth = depth_.data(),
                     .alpha = alpha_.data()};
  device_.launch(image_.tiles(), kernel);
}

template <class Device>
void Engine<Device>::draw(const DeviceView& view, bool keep) {
  begin(view);
  reserve_instances(keep);
  device_.mark(kStart);
  project();
  device_.mark(kProjected);
  list_instances();
  device_.mark(kSorted);
  blend(keep);
  device_.mark(kBlended);
}

template <class Device>
void Engine<Device>::compare(const Target& target, const DeviceLoss& loss) {
  dl_drgb_.reserve(3 * plane());
  loss_sums_.reserve(size_t{3} * kLossSums * num_tiles());
  const Comparison images{rgb_.data(),
                          target.planes.rgb,
                          target.planes.mask,
                          image_,
                          {loss.gain[0], loss.gain[1], loss.gain[2]},
                          {loss.bias[0], loss.bias[1], loss.bias[2]}};
  const int blocks = 3 * image_.tiles();
  const float* derivatives = nullptr;
  if (loss.ssim_weight > 0) {
    ssim_derivatives_.reserve(9 * plane());
    device_.launch(blocks, SsimKernel{images, ssim_derivatives_.data(), loss_sums_.data()});
    derivatives = ssim_derivatives_.data();
  } else {
    device_.clear(loss_sums_.data(), size_t{3} * kLossSums * num_tiles() * sizeof(float));
  }
  const double values = 3.0 * std::max(target.num_valid, 1), weight = static_cast<double>(loss.ssim_weight);
  device_.launch(blocks, PhotometricKernel{images, derivatives, static_cast<float>((1 - weight) / values),
                                           static_cast<float>(weight / values), dl_drgb_.data(), loss_sums_.data()});
  device_.launch(3 * kLossSums, SumRows{loss_sums_.data(), image_.tiles(), &results_.data()->sums[0][0]});
}

template <class Device>
void Engine<Device>::compare_depth(const Target& target, float unit, float weight) {
  const int blocks = blocks_for(plane(), DepthLossKernel::kThreads);
  dl_ddepth_.reserve(plane());
  dl_dalpha_.reserve(plane());
  depth_sums_.reserve(static_cast<size_t>(blocks));
  device_.launch(blocks, DepthLossKernel{depth_.data(), alpha_.data(), target.planes.depth, static_cast<int>(plane()),
                                         unit, weight / static_cast<float>(target.num_depth), dl_ddepth_.data(),
                                         dl_dalpha_.data(), depth_sums_.data()});
  device_.launch(1, SumRows{depth_sums_.data(), blocks, &results_.data()->depth});
}

template <class Device>
void Engine<Device>::unblend(bool with_depth, bool with_alpha) {
  constexpr int kBlocksPerUnit = 16;  // of 128 threads: as many as a multiprocessor holds
  Results* const r = results_.data();
  device_.launch(8,
                 ClearRecords{tile_pairs_.values(), tile_begin_.data() + num_tiles(), &r->instances, records_.data()});
  device_.launch(kBlocksPerUnit * device_.num_units(),
                 UnblendKernel{lists(), image_, checkpoints_.data(), used_buckets_.data(), &r->buckets, rgb_.data(),
                               depth_.data(), alpha_.data(), dl_drgb_.data(), with_depth ? dl_ddepth_.data() : nullptr,
                               with_alpha ? dl_dalpha_.data() : nullptr, records_.data()});
}

template <class Device>
// NOLINTNEXTLINE(readability-non-const-parameter): the kernel writes to it
void Engine<Device>::update_model(const UpdateConstants& constants, bool update, float* dense) {
  Results* const r = results_.data();
  pose_.reserve(6 * std::max<size_t>(num_blocks_, 1));
  device_.launch(static_cast<int>(num_blocks_),
                 UpdateKernel{blocks_.data(), views_.data(), image_, sh_degree_, tiles_.data(), first_instance_.data(),
                              records_.data(), &r->instances, &r->lost, &r->visible, tolerate_lost_, update, constants,
                              dense, pose_.data()});
  if (num_blocks_ > 0) device_.launch(6, SumRows{pose_.data(), static_cast<int>(num_blocks_), r->pose});
}

template <class Device>
Figures Engine<Device>::read_figures(Mark first, Mark last) {
  Results results;
  device_.download(&results, results_.data(), sizeof(results));
  Figures figures;
  figures.visible = results.visible;
  figures.instances = results.instances;
  figures.lost = results.lost;
  for (int c = 0; c < 3; ++c) {
    const double* sums = results.sums[c];
    figures.channels[c] = {sums[kSumL1], sums[kSumMse], sums[kSumBias], sums[kSumValue], sums[kSumSsim]};
  }
  figures.depth = results.depth;
  std::copy_n(results.pose, 6, figures.pose);
  for (int i = first; i < last; ++i) figures.times[i] = device_.milliseconds(i, i + 1);
  return figures;
}

/// True: there was too little room for the instances and now there is more. The iteration has to run again; the model
/// has not changed.
template <class Device>
bool Engine<Device>::has_lost_too_many(const Figures& figures, bool keep) {
  if (figures.lost == 0 || tolerate_lost_) return false;
  const uint32_t before = capacity_;
  if (before >= most_instances_) {
    tolerate_lost_ = true;
    return true;
  }
  const uint64_t wanted = uint64_t{figures.instances} + figures.lost;
  capacity_ = static_cast<uint32_t>(std::min<uint64_t>(wanted + wanted / 4, most_instances_));
  try {
    reserve_instances(keep);
  } catch (const DeviceError& error) {
    if (!error.out_of_memory) throw;
    tile_pairs_.release();
    instance_slots_.release();
    records_.release();
    checkpoints_.release();
    capacity_ = before;
    tolerate_lost_ = true;
  }
  return true;
}

template <class Device>
Figures Engine<Device>::forward(const DeviceView& view, bool keep) {
  while (true) {
    draw(view, keep);
    const Figures figures = read_figures(kStart, kBlended);
    if (!has_lost_too_many(figures, keep)) return figures;
  }
}

template <class Device>
void Engine<Device>::read_image(const ImagePlanes& image) {
  if (image.rgb != nullptr) device_.download(image.rgb, rgb_.data(), 3 * plane() * sizeof(float));
  if (image.depth != nullptr) device_.download(image.depth, depth_.data(), plane() * sizeof(float));
  if (image.alpha != nullptr) device_.download(image.alpha, alpha_.data(), plane() * sizeof(float));
}

template <class Device>
Figures Engine<Device>::backward(const float* dl_drgb, const float* dl_ddepth, const float* dl_dalpha, float* dense) {
  const auto take = [&](Buffer<float>& to, const float* from, size_t count) {
    if (from == nullptr) return;
    to.reserve(count);
    device_.upload(to.data(), from, count * sizeof(float));
  };
  take(dl_drgb_, dl_drgb, 3 * plane());
  take(dl_ddepth_, dl_ddepth, plane());
  take(dl_dalpha_, dl_dalpha, plane());
  const size_t values = size_t{num_blocks_} * row::kCount * kBlockSize;
  dense_.reserve(values);
  device_.mark(kCompared);
  unblend(dl_ddepth != nullptr, dl_dalpha != nullptr);
  device_.mark(kUnblended);
  update_model({}, false, dense_.data());
  device_.mark(kUpdated);
  device_.download(dense, dense_.data(), values * sizeof(float));
  return read_figures(kCompared, kUpdated);
}

template <class Device>
Figures Engine<Device>::step(const DeviceView& view, const DeviceTarget& target, const DeviceLoss& loss,
                             const UpdateConstants& constants, bool update) {
  while (true) {
    draw(view, true);
    const Target& compared = targets_.get(target, target.factor, loss.depth_weight > 0);
    const bool with_depth = loss.depth_weight > 0 && compared.num_depth > 0;
    compare(compared, loss);
    if (with_depth) compare_depth(compared, target.depth_unit, loss.depth_weight);
    device_.mark(kCompared);
    unblend(with_depth, with_depth);
    device_.mark(kUnblended);
    update_model(constants, update, nullptr);
    device_.mark(kUpdated);
    Figures figures = read_figures(kStart, kUpdated);
    figures.num_valid = compared.num_valid;
    figures.num_depth = compared.num_depth;
    if (!has_lost_too_many(figures, true)) return figures;
  }
}

}  // namespace photoslam::splatting::cuda
