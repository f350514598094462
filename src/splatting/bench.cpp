// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/bench.h"

#include <algorithm>
#include <vector>

#include "base/check.h"
#include "base/clock.h"
#include "splatting/cpu/buffer.h"
#include "splatting/cpu/targets.h"
#include "splatting/gpu.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/bench.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "splatting/cpu/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

/// Runs `count` x 12 independent vector FMAs; returns the number of floating-point operations.
double fma_kernel(int count, float* out) {
  Vec sums[12];
  for (Vec& sum : sums) sum = hn::Set(kFloats, 1.0f);
  const volatile float factor = 0.999f, offset = 0.001f;  // or a compiler may see that the sums stay 1
  const Vec a = hn::Set(kFloats, factor), b = hn::Set(kFloats, offset);
  for (int i = 0; i < count; ++i)
    for (Vec& sum : sums) sum = hn::MulAdd(sum, a, b);
  Vec total = hn::Zero(kFloats);
  for (const Vec sum : sums) total = hn::Add(total, sum);
  hn::StoreU(total, kFloats, out);
  return 2.0 * 12 * static_cast<double>(kLanes) * count;
}

void triad_kernel(float* a, const float* b, const float* c, size_t size) {
  const Vec scale = hn::Set(kFloats, 3.0f);
  for (size_t i = 0; i < size; i += kLanes)
    hn::Store(hn::MulAdd(scale, hn::Load(kFloats, c + i), hn::Load(kFloats, b + i)), kFloats, a + i);
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::splatting {
namespace {

HWY_EXPORT(fma_kernel);
HWY_EXPORT(triad_kernel);
HWY_EXPORT(target_name);

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Samples of every stage, reduced to medians.
struct Samples {
  std::vector<double> project, sort, forward, loss, backward, update, total, visible, render;

  void add(const StepResult& step, double milliseconds) {
    project.push_back(step.times.project);
    sort.push_back(step.times.sort);
    forward.push_back(step.times.forward);
    loss.push_back(step.times.loss);
    backward.push_back(step.times.backward);
    update.push_back(step.times.update);
    visible.push_back(step.visible);
    total.push_back(milliseconds);
  }
  StageTimes medians() const {
    return {median(project), median(sort), median(forward), median(loss), median(backward), median(update)};
  }
};

}  // namespace

BenchReport bench_training(GaussianModel& model, std::span<const BenchView> views, int rounds,
                           const TrainOptions& options, Executor& executor, const std::shared_ptr<Gpu>& gpu) {
  PHOTOSLAM_CHECK(!views.empty() && rounds >= 1, "{} views, {} rounds", views.size(), rounds);
  Trainer trainer(gpu);
  Samples samples;
  BenchReport report{.gaussians = model.size(), .stages = {}};
  std::vector<Pose> poses(static_cast<size_t>(model.num_anchors()));
  Stopwatch wall;
  for (int round = -1; round < rounds; ++round) {
    if (round == 0) wall.restart();
    float loss = 0;
    for (const BenchView& view : views) {
      std::fill(poses.begin(), poses.end(), view.camera_from_model);
      Stopwatch watch;
      const StepResult step = trainer.step(model, {view.camera, poses}, view.target, options, executor);
      loss += step.loss / static_cast<float>(views.size());
      if (round >= 0) samples.add(step, watch.milliseconds());
    }
    if (round <= 0) report.loss_first = loss;
    report.loss_last = loss;
  }
  report.wall_ms = wall.milliseconds();
  Renderer renderer(gpu);
  RenderResult image;
  for (int round = -1; round < rounds; ++round)
    for (const BenchView& view : views) {
      std::fill(poses.begin(), poses.end(), view.camera_from_model);
      Stopwatch watch;
      renderer.render(model, {view.camera, poses}, options.render, executor, image);
      const bool on_gpu = gpu != nullptr && gpu->failure().empty();
      if (round >= 0) samples.render.push_back(on_gpu ? renderer.times().total() : watch.milliseconds());
    }
  report.iterations = static_cast<int>(samples.total.size());
  report.visible = median(samples.visible);
  report.iteration_ms = median(samples.total);
  report.render_ms = median(samples.render);
  report.stages = samples.medians();
  return report;
}

MachineProbe probe_machine(Executor& executor) {
  const int workers = executor.concurrency();
  constexpr int kRepeats = 5;
  MachineProbe probe;
  std::vector<double> operations(static_cast<size_t>(workers));
  std::vector<float> sink(static_cast<size_t>(workers) * 16);
  constexpr size_t kArray = size_t{1} << 23;  // 32 MB each: beyond what a core's caches hold
  Buffer<float> arrays;
  arrays.reserve(3 * kArray);
  std::fill_n(arrays.data(), 3 * kArray, 1.0f);
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    Stopwatch watch;
    executor.for_each(workers, [&](int i, int) {
      operations[static_cast<size_t>(i)] =
          HWY_DYNAMIC_DISPATCH(fma_kernel)(2000000, &sink[static_cast<size_t>(i) * 16]);
    });
    double total = 0;
    for (double n : operations) total += n;
    probe.fma_gflops = std::max(probe.fma_gflops, total / watch.seconds() * 1e-9);
    watch.restart();
    const size_t slice = kArray / static_cast<size_t>(workers) / 16 * 16;
    executor.for_each(workers, [&](int i, int) {
      float* a = arrays.data() + static_cast<size_t>(i) * slice;
      HWY_DYNAMIC_DISPATCH(triad_kernel)(a, a + kArray, a + 2 * kArray, slice);
    });
    const double bytes = 3.0 * sizeof(float) * static_cast<double>(slice) * workers;
    probe.triad_gbs = std::max(probe.triad_gbs, bytes / watch.seconds() * 1e-9);
  }
  return probe;
}

const char* simd_target() { return HWY_DYNAMIC_DISPATCH(target_name)(); }

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
