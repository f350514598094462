// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Trainer, renderer and model with their values elsewhere, against the CPU. The GPU is the host in its role; the module
// is tried where there is one and a GPU.
#ifndef __SANITIZE_THREAD__  // it does not know fibers
#include "splatting/gpu.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/archive.h"
#include "base/check.h"
#include "base/clock.h"
#include "splatting/cuda/engine.h"
#include "splatting/cuda/host_device.h"
#include "splatting/testing/scenes.h"

namespace photoslam::splatting {
namespace {

using cuda::DeviceError;
using testing::Scene;

struct Faults {
  int calls_left = -1;  ///< Until everything fails for good; -1: never.
  int steps_left = -1;  ///< Until steps fail, as they do when memory is short.
  int fetches = 0;
};

/// The host as a GPU whose arrays grow by more than is asked for, so that the next time there is room.
class RoomyDevice final : public cuda::HostDevice {
 public:
  static constexpr size_t kSpareShare = 2;
};

/// The engine on the host, that fails when told to.
template <class Device>
class FragileEngineOn final : public cuda::DeviceEngine {
 public:
  FragileEngineOn(Faults& fate, uint64_t memory_limit) : fate_(fate), engine_(Device(), memory_limit) {}

  void arrange(const cuda::Arrangement& arrangement) override { live().arrange(arrangement); }
  void fetch(int first_row, int num_rows, float* rows) override {
    ++fate_.fetches;
    live().fetch(first_row, num_rows, rows);
  }
  void judge(const DensityRules& rules, Fate* fates) override { live().judge(rules, fates); }
  void breed(const Child* children, uint32_t count) override { live().breed(children, count); }
  cuda::Figures forward(const cuda::DeviceView& view, bool keep) override { return live().forward(view, keep); }
  void read_image(const cuda::ImagePlanes& image) override { live().read_image(image); }
  cuda::Figures backward(const float* dl_drgb, const float* dl_ddepth, const float* dl_dalpha, float* dense) override {
    return live().backward(dl_drgb, dl_ddepth, dl_dalpha, dense);
  }
  cuda::Figures step(const cuda::DeviceView& view, const cuda::DeviceTarget& target, const cuda::DeviceLoss& loss,
                     const UpdateConstants& constants, bool update) override {
    if (fate_.steps_left == 0) throw DeviceError("no memory left", true);
    if (fate_.steps_left > 0) --fate_.steps_left;
    return live().step(view, target, loss, constants, update);
  }
  void forget_target(uint64_t id) override { engine_.forget_target(id); }
  std::unique_ptr<cuda::DeviceUndistorter> make_undistorter(const cuda::DeviceLens* lenses, int count) override {
    return live().make_undistorter(lenses, count);
  }
  uint64_t peak_bytes() const override { return engine_.peak_bytes(); }

 private:
  cuda::DeviceEngine& live() {
    if (fate_.calls_left == 0) throw DeviceError("the GPU has fallen off the bus", false);
    if (fate_.calls_left > 0) --fate_.calls_left;
    return engine_;
  }
  Faults& fate_;
  cuda::Engine<Device> engine_;
};

std::shared_ptr<Gpu> make_gpu(Faults& fate) {
  return std::make_shared<Gpu>(std::make_unique<FragileEngineOn<cuda::HostDevice>>(fate, uint64_t{1} << 30), "host");
}

Scene small_scene(uint64_t seed) {
  Scene scene;
  scene.width = 40;
  scene.height = 33;
  scene.count = 150;
  scene.anchors = 3;
  scene.build(seed);
  return scene;
}

/// What the scene's view should look like, at `factor` times its resolution and a rest.
TargetImage make_target(const Scene& scene, uint64_t seed, int factor = 1) {
  Random random(seed);
  const int width = factor * (scene.width + 1) - 1, height = factor * (scene.height + 1) - 1;
  const auto pixels = static_cast<size_t>(width * height);
  std::vector<uint8_t> rgb(3 * pixels), mask(pixels);
  std::vector<float> depth(pixels);
  for (uint8_t& v : rgb) v = static_cast<uint8_t>(random.index(256));
  for (uint8_t& v : mask) v = random.uniform() < 0.9 ? 255 : 0;
  for (float& d : depth) d = random.uniform() < 0.7 ? static_cast<float>(random.uniform(1, 4)) : 0.0f;
  TargetImage target(width, height, rgb, mask);
  target.set_depth(depth);
  return target;
}

TrainOptions train_options(const Scene& scene) {
  TrainOptions options;
  options.render = scene.options;
  options.depth_weight = 0.1f;
  options.opacity_weight = 0.01f;
  options.exposure = {{1.1f, 0.9f, 1}, {0.01f, 0, -0.02f}};
  return options;
}

std::vector<float> table_of(const GaussianModel& model) {
  std::vector<float> values;
  model.for_each([&](size_t index) {
    for (int r = 0; r < row::kTableRows; ++r)
      values.push_back(
          table(model.block(index / kBlockSize))[static_cast<size_t>(r) * kBlockSize + index % kBlockSize]);
  });
  return values;
}

/// Relative distance per row. The two engines need not agree on whether a gaussian whose ellipse passes between pixels
/// counts as visible: those are left out, but there must be few and they must weigh nothing.
void expect_close(const GaussianModel& got, const GaussianModel& want, double tolerance) {
  const std::vector<float> a = table_of(got), b = table_of(want);
  ASSERT_EQ(a.size(), b.size());
  constexpr auto kRows = static_cast<size_t>(row::kTableRows), kUpdates = static_cast<size_t>(row::kStatistics) - 1;
  std::vector<double> difference(kRows), norm(kRows);
  size_t left_out = 0;
  for (size_t g = 0; g < a.size(); g += kRows) {
    if (a[g + kUpdates] != b[g + kUpdates]) {
      ++left_out;
      EXPECT_EQ(a[g + kUpdates + 2], 0.0f);  // the weight
      EXPECT_EQ(b[g + kUpdates + 2], 0.0f);
      continue;
    }
    for (size_t r = 0; r < kRows; ++r) {
      difference[r] += std::pow(static_cast<double>(a[g + r]) - static_cast<double>(b[g + r]), 2);
      norm[r] += std::pow(static_cast<double>(b[g + r]), 2);
    }
  }
  EXPECT_LE(left_out, a.size() / kRows / 50);
  for (size_t r = 0; r < kRows; ++r)
    EXPECT_LE(std::sqrt(difference[r]), tolerance * std::sqrt(norm[r]) + 1e-30) << "row " << r;
}

void expect_close(const StepResult& got, const StepResult& want) {
  EXPECT_NEAR(got.loss, want.loss, 1e-5f);
  EXPECT_NEAR(got.l1, want.l1, 1e-5f);
  EXPECT_NEAR(got.ssim, want.ssim, 1e-5f);
  EXPECT_NEAR(got.mse, want.mse, 1e-5f);
  EXPECT_NEAR(got.depth, want.depth, 1e-5f);
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(got.pose_gradient[i], want.pose_gradient[i], 2e-4f * std::abs(want.pose_gradient[i]) + 1e-5f) << i;
    EXPECT_NEAR(got.exposure_gradient[i], want.exposure_gradient[i],
                2e-4f * std::abs(want.exposure_gradient[i]) + 1e-6f)
        << i;
  }
}

void expect_training_as_on_the_cpu(const std::shared_ptr<Gpu>& gpu) {
  Scene here = small_scene(51), there = small_scene(51);
  const TargetImage target = make_target(here, 52);
  TrainOptions options = train_options(here);
  options.update = false;
  SerialExecutor executor;
  Trainer cpu, remote(gpu);
  // Alone, steps are alike; several after each other grow apart where a gradient is nearly zero.
  expect_close(remote.step(there.model, there.view, target, options, executor),
               cpu.step(here.model, here.view, target, options, executor));
  options.update = true;
  for (int i = 0; i < 4; ++i) {
    options.ssim_weight = i % 2 == 0 ? 0.2f : 0.0f;
    expect_close(remote.step(there.model, there.view, target, options, executor),
                 cpu.step(here.model, here.view, target, options, executor));
    const RenderResult &got = remote.rendered(), &want = cpu.rendered();
    for (size_t k = 0; k < want.rgb.size(); ++k) ASSERT_NEAR(got.rgb[k], want.rgb[k], 1e-3f);
  }
  expect_close(there.model, here.model, 2e-3);
}

/// Of images and models, and whatever part of the target's resolution.
void expect_steps_of_any_size_as_on_the_cpu(const std::shared_ptr<Gpu>& gpu) {
  SerialExecutor executor;
  Random random(65);
  for (int round = 0; round < 12; ++round) {
    Scene scene;
    scene.width = 1 + random.index(66);
    scene.height = 1 + random.index(50);
    scene.count = round < 2 ? round : 1 + random.index(150);
    scene.anchors = 1 + random.index(3);
    scene.build(static_cast<uint64_t>(round));
    TrainOptions options = train_options(scene);
    options.update = false;
    options.render.shrink_factor = 1 + random.index(4);
    const TargetImage target = make_target(scene, 66, options.render.shrink_factor);
    Trainer cpu, remote(gpu);
    const StepResult want = cpu.step(scene.model, scene.view, target, options, executor);
    expect_close(remote.step(scene.model, scene.view, target, options, executor), want);
    const RenderResult &got = remote.rendered(), &image = cpu.rendered();
    for (size_t k = 0; k < image.rgb.size(); ++k) ASSERT_NEAR(got.rgb[k], image.rgb[k], 1e-5f) << round;
    for (size_t k = 0; k < image.alpha.size(); ++k) ASSERT_NEAR(got.alpha[k], image.alpha[k], 1e-5f) << round;
  }
}

TEST(Gpu, TrainsAsTheCpuDoes) {
  Faults fate;
  expect_training_as_on_the_cpu(make_gpu(fate));
  expect_steps_of_any_size_as_on_the_cpu(make_gpu(fate));
}

TEST(Gpu, IsBusyWhileItDrawsAndTrains) {
  Faults fate;
  const auto gpu = make_gpu(fate);
  EXPECT_EQ(gpu->busy_seconds(), 0);
  Scene scene = small_scene(67);
  const TargetImage target = make_target(scene, 68);
  SerialExecutor executor;
  Trainer trainer(gpu);
  Gradients gradients;
  const Stopwatch watch;
  const double step = trainer.step(scene.model, scene.view, target, train_options(scene), executor).times.total();
  EXPECT_GT(step, 0);
  EXPECT_NEAR(gpu->busy_seconds(), 1e-3 * step, 1e-9);
  trainer.forward(scene.model, scene.view, scene.options, executor);
  const double drawn = gpu->busy_seconds();
  EXPECT_GT(drawn, 1e-3 * step);
  trainer.backward(scene.model, std::vector<float>(3 * scene.plane(), 1), {}, {}, executor, gradients);
  EXPECT_GT(gpu->busy_seconds(), drawn);
  EXPECT_LT(gpu->busy_seconds(), watch.seconds());
}

TEST(Gpu, OfThisMachineTrainsAsTheCpuDoes) {
  const auto gpu = Gpu::open(1000);
  if (!gpu) GTEST_SKIP() << gpu.error().message;
  expect_training_as_on_the_cpu(*gpu);
  expect_steps_of_any_size_as_on_the_cpu(*gpu);
  EXPECT_EQ((*gpu)->failure(), "");
}

TEST(Gpu, DrawsAsTheCpuDoes) {
  Faults fate;
  const Scene scene = small_scene(53);
  SerialExecutor executor;
  RenderResult want, got;
  Renderer().render(scene.model, scene.view, scene.options, executor, want);
  Renderer remote(make_gpu(fate));
  for (int i = 0; i < 2; ++i) {
    remote.render(scene.model, scene.view, scene.options, executor, got);
    ASSERT_EQ(got.rgb.size(), want.rgb.size());
    for (size_t k = 0; k < want.rgb.size(); ++k) ASSERT_NEAR(got.rgb[k], want.rgb[k], 2e-6f);
    for (size_t k = 0; k < want.depth.size(); ++k) ASSERT_NEAR(got.depth[k], want.depth[k], 1e-5f);
  }
}

/// By the rules some go; of the others some double.
void densify(GaussianModel& model, Random& random) {
  DensityRules rules;
  rules.by_shape = rules.by_statistics = true;
  rules.min_opacity_logit = -2;
  rules.max_log_scale = 10;
  rules.views_to_judge = 0.5f;
  rules.min_weight = 0.1;
  rules.gradient_threshold = 1e9;
  std::vector<Fate> fates = model.judge(rules);
  std::vector<double> normals;
  model.for_each([&](size_t i) {
    if (fates[i] != Fate::stays || random.uniform() < 0.7) return;
    fates[i] = random.uniform() < 0.5 ? Fate::clones : Fate::splits;
    for (int k = 0; fates[i] == Fate::splits && k < 6; ++k) normals.push_back(random.normal());
  });
  model.breed(fates, normals);
}

/// What densification, seeding and loop corrections do to a model.
void edit(GaussianModel& model, int kind, Random& random) {
  Gaussian g;
  if (kind == 0) {
    const std::vector<Gaussian> seeds(static_cast<size_t>(1 + random.index(90)));
    model.add(random.index(model.num_anchors()), seeds, 7, 8);
  } else if (kind == 1) {
    model.remove_if([&](size_t) { return random.uniform() < 0.2; });
  } else if (kind == 2) {
    model.rescale_anchor(random.index(model.num_anchors()), 1.25f);
  } else if (kind == 3) {
    model.reset_statistics();
  } else if (kind == 4) {
    model.sort_spatially();
  } else if (kind == 5) {
    const size_t index = kBlockSize * static_cast<size_t>(random.index(static_cast<int>(model.num_blocks())));
    g = model.get(index);
    g.mean[0] += 1;
    model.set(index, g);
    model.reset_optimizer(index);
  } else if (kind == 6) {
    densify(model, random);
  }
}

/// A remote copy without arithmetic: what comes back must be what a model without one holds, bit for bit.
void expect_models_to_survive_changes_on(const std::shared_ptr<Gpu>& gpu) {
  Scene plain = small_scene(54), remote = small_scene(54);
  Random statistics(55);
  plain.model.for_each([&](size_t i) {
    float* values = table(plain.model.block(i / kBlockSize)) + i % kBlockSize;
    for (int r = row::kOptimizer; r < row::kTableRows; ++r)
      values[r * kBlockSize] = static_cast<float>(statistics.uniform());
  });
  for (size_t b = 0; b < plain.model.num_blocks(); ++b) remote.model.block(b) = plain.model.block(b);
  StageTimes times;
  int visible = 0;
  Random choices(56);
  for (int round = 0; round < 40; ++round) {
    const int kind = choices.index(7);
    Random a(static_cast<uint64_t>(round)), b(static_cast<uint64_t>(round));
    edit(plain.model, kind, a);
    edit(remote.model, kind, b);
    if (choices.index(3) == 0) continue;  // several changes before an exchange
    ASSERT_TRUE(gpu->forward(remote.model, remote.view, {.sh_degree = 0}, false, times, visible));
    if (choices.index(2) == 0) continue;
    remote.model.trained_remotely();  // the values here may be old: they must be fetched
    const bool look = choices.index(2) == 0;
    if (look) {
      EXPECT_EQ(remote.model.get(0).mean[1], plain.model.get(0).mean[1]);
    }
  }
  EXPECT_EQ(table_of(remote.model), table_of(plain.model));
  Archive want, got;
  plain.model.serialize(want);
  remote.model.serialize(got);
  EXPECT_EQ(want.bytes(), got.bytes());
}

TEST(Gpu, ModelsSurviveAnyOrderOfChangesAndExchanges) {
  Faults fate;
  expect_models_to_survive_changes_on(make_gpu(fate));
  expect_models_to_survive_changes_on(
      std::make_shared<Gpu>(std::make_unique<FragileEngineOn<RoomyDevice>>(fate, uint64_t{1} << 30), "host"));
}

TEST(Gpu, FetchesOnceAndOnlyWhatIsAskedFor) {
  Faults fate;
  Scene scene = small_scene(57);
  const TargetImage target = make_target(scene, 58);
  SerialExecutor executor;
  Trainer trainer(make_gpu(fate));
  trainer.step(scene.model, scene.view, target, train_options(scene), executor);
  trainer.step(scene.model, scene.view, target, train_options(scene), executor);
  EXPECT_EQ(fate.fetches, 0);
  scene.model.for_each([&](size_t i) { (void)scene.model.get(i); });
  EXPECT_EQ(fate.fetches, 1);
  EXPECT_GT(scene.model.statistics(0).visible + scene.model.statistics(1).visible, 0);
  EXPECT_EQ(fate.fetches, 2);
  scene.model.add(0, std::vector<Gaussian>(3));
  trainer.step(scene.model, scene.view, target, train_options(scene), executor);
  Random random(59);
  densify(scene.model, random);
  trainer.step(scene.model, scene.view, target, train_options(scene), executor);
  EXPECT_EQ(fate.fetches, 2);
}

TEST(Gpu, WhenMemoryRunsOutTheCpuContinuesFromTheSameValues) {
  Faults fate, sound;
  Scene scene = small_scene(59), other = small_scene(59);
  const TargetImage target = make_target(scene, 60);
  const TrainOptions options = train_options(scene);
  SerialExecutor executor;
  const auto gpu = make_gpu(fate);
  Trainer trainer(gpu), reference(make_gpu(sound)), cpu;
  fate.steps_left = 2;
  for (int i = 0; i < 2; ++i) {
    trainer.step(scene.model, scene.view, target, options, executor);
    reference.step(other.model, other.view, target, options, executor);
  }
  trainer.step(scene.model, scene.view, target, options, executor);
  EXPECT_EQ(gpu->failure(), "no memory left");
  EXPECT_EQ(scene.model.remote(), nullptr);
  cpu.step(other.model, other.view, target, options, executor);
  EXPECT_EQ(table_of(scene.model), table_of(other.model));
}

TEST(Gpu, WhenItIsGoneTheCpuContinuesFromWhatWasFetchedLast) {
  Faults fate;
  Scene scene = small_scene(61);
  const TargetImage target = make_target(scene, 62);
  const TrainOptions options = train_options(scene);
  SerialExecutor executor;
  const auto gpu = make_gpu(fate);
  Trainer trainer(gpu);
  Renderer renderer(gpu);
  for (int i = 0; i < 3; ++i) trainer.step(scene.model, scene.view, target, options, executor);
  const std::vector<float> fetched = table_of(scene.model);
  trainer.step(scene.model, scene.view, target, options, executor);
  fate.calls_left = 0;
  EXPECT_EQ(table_of(scene.model), fetched);
  EXPECT_NE(gpu->failure(), "");
  const StepResult result = trainer.step(scene.model, scene.view, target, options, executor);
  EXPECT_GT(result.visible, 0);
  RenderResult image;
  renderer.render(scene.model, scene.view, scene.options, executor, image);
  EXPECT_EQ(image.width, scene.width);
}

TEST(Gpu, HoldsOneModelAtATime) {
  Faults fate;
  const auto gpu = make_gpu(fate);
  StageTimes times;
  int visible = 0;
  const Scene second = small_scene(64);
  {
    const Scene first = small_scene(63);
    EXPECT_TRUE(gpu->forward(first.model, first.view, {}, false, times, visible));
    EXPECT_THROW((void)gpu->forward(second.model, second.view, {}, false, times, visible), CheckError);
  }
  EXPECT_TRUE(gpu->forward(second.model, second.view, {}, false, times, visible));
}

TEST(Gpu, BackendsAreChosenByName) {
  std::string note;
  const auto none = choose_backend(parse_backend("cpu"), 100, note);
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(*none, nullptr);
  EXPECT_EQ(note, "");
  const auto automatic = choose_backend(parse_backend("auto"), 100, note);
  ASSERT_TRUE(automatic.ok());
  const auto asked = choose_backend(parse_backend("cuda"), 100, note);
  EXPECT_EQ(asked.ok(), *automatic != nullptr);
  EXPECT_EQ(note.empty(), asked.ok());
  EXPECT_THROW(parse_backend("metal"), CheckError);
}

}  // namespace
}  // namespace photoslam::splatting

#endif  // __SANITIZE_THREAD__
