// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// The kernels, executed on the host, against plain code and the double-precision oracle.
#ifndef __SANITIZE_THREAD__  // it does not know fibers

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "splatting/cuda/gradient_kernels.h"
#include "splatting/cuda/host_execution.h"
#include "splatting/cuda/sort_kernels.h"
#include "splatting/testing/scenes.h"

namespace photoslam::splatting::cuda {
namespace {

using testing::Scene;

constexpr uint32_t kGuard = 0xabababab;

/// Stable radix sort by the lowest `bits` of the keys, as the device runs it.
void sort_pairs(std::vector<uint32_t>& keys, std::vector<uint32_t>& values, uint32_t size, int bits) {
  const uint32_t capacity = static_cast<uint32_t>(keys.size());
  const int blocks = std::max(1, num_sort_blocks(capacity));
  std::vector<uint32_t> histogram(kRadix * static_cast<size_t>(blocks)), totals(kRadix);
  std::vector<uint32_t> to_keys(capacity, kGuard), to_values(capacity, kGuard);
  for (int shift = 0; shift < bits; shift += 8) {
    run_on_host(blocks, CountDigits{keys.data(), &size, shift, histogram.data()});
    run_on_host(kRadix, PrefixRows{histogram.data(), static_cast<uint32_t>(blocks), totals.data()});
    run_on_host(blocks, ScatterDigits{keys.data(), values.data(), &size, shift, histogram.data(), totals.data(),
                                      to_keys.data(), to_values.data()});
    keys.swap(to_keys);
    values.swap(to_values);
  }
}

int blocks_for(size_t items, int threads) {
  return static_cast<int>((items + static_cast<size_t>(threads) - 1) / static_cast<size_t>(threads));
}

/// One view through all kernels.
struct Pipeline {
  std::vector<Block> blocks;
  std::vector<AnchorView> views;
  Extent image{};
  RenderOptions options;
  std::vector<Splat> splats;
  std::vector<uint32_t> order, tiles, first_instance;
  std::vector<uint32_t> entries, instance_slots, tile_begin, bucket_begin, used_buckets;
  std::vector<Checkpoint> checkpoints;
  uint32_t instances = 0, lost = 0, num_buckets = 0;
  std::vector<float> rgb, depth, alpha;

  Pipeline(const Scene& scene, uint32_t capacity) : image{scene.width, scene.height}, options(scene.options) {
    for (size_t i = 0; i < scene.model.num_blocks(); ++i) blocks.push_back(scene.model.block(i));
    for (const splatting::Pose& pose : scene.poses)
      views.push_back(make_anchor_view(pose, scene.view.camera, options.near));
    options.sh_degree = std::min(options.sh_degree, scene.model.sh_degree());
    list_instances(capacity);
    blend();
  }

  TileLists lists() const {
    return {splats.data(), entries.data(), instance_slots.data(), tile_begin.data(), bucket_begin.data()};
  }

  void list_instances(uint32_t capacity) {
    const uint32_t slots = static_cast<uint32_t>(blocks.size()) * kBlockSize;
    const uint32_t num_tiles = static_cast<uint32_t>(image.tiles());
    splats.resize(slots);
    order.resize(slots);
    tiles.resize(slots);
    first_instance.resize(slots);
    std::vector<uint32_t> keys(slots), offsets;
    run_on_host(blocks_for(slots, ProjectKernel::kThreads),
                ProjectKernel{blocks.data(), slots, views.data(), image, options.sh_degree, splats.data(), keys.data(),
                              order.data(), tiles.data()});
    sort_pairs(keys, order, slots, 32);
    // Prefix sums in two levels: rows of kColumns, then the rows' totals.
    constexpr uint32_t kColumns = 128;
    const uint32_t rows = (slots + kColumns - 1) / kColumns;
    offsets.assign(rows * kColumns, kGuard);
    std::vector<uint32_t> totals(rows, kGuard);
    run_on_host(blocks_for(offsets.size(), GatherCounts::kThreads),
                GatherCounts{order.data(), tiles.data(), slots, rows * kColumns, offsets.data()});
    run_on_host(static_cast<int>(rows), PrefixRows{offsets.data(), kColumns, totals.data()});
    run_on_host(1, PrefixRows{totals.data(), rows, &instances});
    run_on_host(static_cast<int>(rows), AddToRows{offsets.data(), kColumns, totals.data()});

    std::vector<uint32_t> tile_keys(capacity, kGuard);
    entries.assign(capacity, kGuard);
    instance_slots.assign(capacity, kGuard);
    run_on_host(blocks_for(slots, EmitInstances::kThreads),
                EmitInstances{order.data(), tiles.data(), offsets.data(), slots, splats.data(), image, capacity,
                              tile_keys.data(), entries.data(), instance_slots.data(), first_instance.data()});
    run_on_host(1, BoundInstances{&instances, capacity, &lost});
    sort_pairs(tile_keys, entries, instances, 16);
    tile_begin.assign(num_tiles + 1, kGuard);
    run_on_host(blocks_for(capacity + 1, FindTiles::kThreads),
                FindTiles{tile_keys.data(), &instances, num_tiles, tile_begin.data()});
    bucket_begin.assign(num_tiles, kGuard);
    run_on_host(blocks_for(num_tiles, CountBuckets::kThreads),
                CountBuckets{tile_begin.data(), num_tiles, bucket_begin.data()});
    run_on_host(1, PrefixRows{bucket_begin.data(), num_tiles, &num_buckets});
  }

  void blend() {
    const size_t plane = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
    rgb.assign(3 * plane, -1);
    depth.assign(plane, -1);
    alpha.assign(plane, -1);
    checkpoints.resize(size_t{num_buckets} * kTilePixels);
    used_buckets.assign(static_cast<size_t>(image.tiles()), kGuard);
    BlendKernel kernel{.lists = lists(),
                       .image = image,
                       .background = {},
                       .checkpoints = checkpoints.data(),
                       .used_buckets = used_buckets.data(),
                       .rgb = rgb.data(),
                       .depth = depth.data(),
                       .alpha = alpha.data()};
    std::copy_n(options.background, 3, kernel.background);
    run_on_host(image.tiles(), kernel);
  }

  /// Dense gradients in the layout of the model's blocks; adds up the pose.
  std::vector<float> gradients(const std::vector<float>& dl_drgb, const std::vector<float>& dl_ddepth,
                               const std::vector<float>& dl_dalpha, std::vector<double>& pose) const {
    std::vector<SplatGradient> records(entries.size());
    run_on_host(3, UnblendKernel{lists(), image, checkpoints.data(), used_buckets.data(), &num_buckets, rgb.data(),
                                 depth.data(), alpha.data(), dl_drgb.data(), dl_ddepth.data(), dl_dalpha.data(),
                                 records.data()});
    std::vector<float> dense(blocks.size() * static_cast<size_t>(row::kCount) * kBlockSize, 1e9f);
    std::vector<float> poses(blocks.size() * 6);
    run_on_host(static_cast<int>(blocks.size()),
                GradientKernel{blocks.data(), views.data(), options.sh_degree, tiles.data(), first_instance.data(),
                               records.data(), dense.data(), poses.data()});
    pose.assign(6, 0);
    for (size_t i = 0; i < poses.size(); ++i) pose[i % 6] += static_cast<double>(poses[i]);
    return dense;
  }
};

constexpr uint32_t kPlenty = 30000;

struct ConnectThreads {
  static constexpr int kThreads = 64;
  struct Shared {
    int values[64];
  };
  int* out;
  void operator()(HostGroup& group, Shared& shared) const {
    shared.values[group.thread()] = group.thread();
    group.sync();
    const int other = shared.values[63 - group.thread()];
    const bool odd = group.lane() % 2 == 1;
    EXPECT_EQ(group.ballot(odd), 0xaaaaaaaau);
    EXPECT_EQ(group.match(group.lane() < 4 ? 1 : 2), group.lane() < 4 ? 0xfu : 0xfffffff0u);
    EXPECT_EQ(group.from_previous(group.thread()), group.lane() == 0 ? group.thread() : group.thread() - 1);
    out[group.block() * 64 + group.thread()] = other;
  }
};

TEST(HostExecution, CollectivesConnectThreads) {
  std::vector<int> out(128);
  run_on_host(2, ConnectThreads{out.data()});
  for (int i = 0; i < 128; ++i) EXPECT_EQ(out[static_cast<size_t>(i)], 63 - i % 64);
}

struct MissBarrier {
  static constexpr int kThreads = 64;
  using Shared = NoShared;
  void operator()(HostGroup& group, NoShared&) const {
    if (group.thread() != 5) group.sync();
  }
};

TEST(HostExecution, ABarrierThatSomeThreadNeverReachesIsAnError) { EXPECT_ANY_THROW(run_on_host(1, MissBarrier{})); }

TEST(CudaKernels, SortIsStable) {
  Random random(5);
  for (const size_t size : {size_t{0}, size_t{1}, size_t{2048}, size_t{5001}}) {
    std::vector<uint32_t> keys(size + 7), values(size + 7);
    for (uint32_t& key : keys) key = static_cast<uint32_t>(random.index(300)) * 70001;
    std::iota(values.begin(), values.end(), 0u);
    std::vector<uint32_t> want(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(size));
    std::stable_sort(want.begin(), want.end(), [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
    sort_pairs(keys, values, static_cast<uint32_t>(size), 32);
    EXPECT_TRUE(std::equal(want.begin(), want.end(), values.begin()));
  }
}

TEST(CudaKernels, ImagesEqualTheOracle) {
  for (Scene& scene : testing::hard_scenes()) {
    scene.build(11);
    const reference::Image want = reference::render(scene.reference_gaussians, scene.reference_view, scene.noise);
    const Pipeline got(scene, kPlenty);
    ASSERT_EQ(got.lost, 0u) << scene.name;
    double worst = 0;
    for (size_t i = 0; i < scene.plane(); ++i) {
      if (want.ambiguous[i]) continue;
      for (size_t k = 0; k < 3; ++k)
        worst = std::max(
            worst, std::abs(static_cast<double>(got.rgb[k * scene.plane() + i]) - want.rgb[k * scene.plane() + i]));
      worst = std::max(worst, std::abs(static_cast<double>(got.alpha[i]) - want.alpha[i]));
      worst = std::max(worst, std::abs(static_cast<double>(got.depth[i]) - want.depth[i]) / scene.depth_max);
    }
    std::printf("  %-16s max error %.1e, %u instances, %u buckets\n", scene.name.c_str(), worst, got.instances,
                got.num_buckets);
    EXPECT_LE(worst, scene.image_tolerance) << scene.name;
  }
}

/// Relative L2 distance; zero against zero is zero.
double relative_error(const std::vector<double>& got, const std::vector<double>& want) {
  double difference = 0, norm = 0;
  for (size_t i = 0; i < got.size(); ++i) {
    difference += (got[i] - want[i]) * (got[i] - want[i]);
    norm += want[i] * want[i];
  }
  return norm > 0 ? std::sqrt(difference / norm) : std::sqrt(difference);
}

TEST(CudaKernels, GradientsEqualTheOracle) {
  constexpr int kGroups[][2] = {{0, 3}, {3, 7}, {7, 10}, {10, 11}, {11, 14}, {14, 59}};
  for (Scene& scene : testing::hard_scenes()) {
    scene.build(12);
    const reference::Image image = reference::render(scene.reference_gaussians, scene.reference_view, scene.noise);
    Random random(13);
    const size_t plane = scene.plane();
    std::vector<double> dl_drgb(3 * plane), dl_ddepth(plane), dl_dalpha(plane);
    for (size_t i = 0; i < plane; ++i) {
      const double keep = image.ambiguous[i] ? 0 : 1;
      for (size_t k = 0; k < 3; ++k) dl_drgb[k * plane + i] = static_cast<float>(keep * random.normal());
      dl_ddepth[i] = static_cast<float>(keep * 0.3 * random.normal());
      dl_dalpha[i] = static_cast<float>(keep * 0.3 * random.normal());
    }
    const reference::Gradients want =
        reference::backward(scene.reference_gaussians, scene.reference_view, dl_drgb, dl_ddepth, dl_dalpha);
    const auto floats = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
    std::vector<double> pose;
    const std::vector<float> got =
        Pipeline(scene, kPlenty).gradients(floats(dl_drgb), floats(dl_ddepth), floats(dl_dalpha), pose);
    for (const auto& group : kGroups) {
      std::vector<double> a, b;
      for (size_t i = 0; i < scene.indices.size(); ++i)
        for (int r = group[0]; r < group[1]; ++r) {
          const size_t index = scene.indices[i];
          const size_t at = (index / kBlockSize * static_cast<size_t>(row::kCount) + static_cast<size_t>(r));
          a.push_back(static_cast<double>(got[at * kBlockSize + index % kBlockSize]));
          b.push_back(want.parameters[i][static_cast<size_t>(r)]);
        }
      EXPECT_LE(relative_error(a, b), scene.gradient_tolerance) << scene.name << " row " << group[0];
    }
    EXPECT_LE(relative_error(pose, {want.pose.begin(), want.pose.end()}), scene.gradient_tolerance) << scene.name;
  }
}

TEST(CudaKernels, InstancesWithoutRoomAreCountedAndLeftOut) {
  Scene scene;
  scene.build(14);
  const Pipeline all(scene, kPlenty);
  const Pipeline some(scene, 300);
  EXPECT_EQ(some.instances, 300u);
  EXPECT_EQ(some.lost, all.instances - 300u);
  // Emitted front to back: what is lost is what lies farthest away.
  EXPECT_TRUE(std::equal(some.instance_slots.begin(), some.instance_slots.end(), all.instance_slots.begin()));
  for (size_t i = 0; i < scene.plane(); ++i) EXPECT_LE(some.alpha[i], all.alpha[i] + 1e-6f);
}

}  // namespace
}  // namespace photoslam::splatting::cuda

#endif  // __SANITIZE_THREAD__
