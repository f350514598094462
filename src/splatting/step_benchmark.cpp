// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Cost of rendering and training against the number of gaussians and of pixels, on a synthetic cloud.
#include <benchmark/benchmark.h>

#include <cmath>
#include <utility>

#include "base/random.h"
#include "splatting/renderer.h"
#include "splatting/trainer.h"

namespace photoslam::splatting {
namespace {

/// `count` gaussians in a 4 m wide room, sized so that they always cover about the same area together.
GaussianModel make_cloud(int count) {
  Random random(1);
  GaussianModel model;
  model.add_anchor();
  std::vector<Gaussian> gaussians(static_cast<size_t>(count));
  const double scale = std::log(0.02 * std::sqrt(1e5 / count));
  for (Gaussian& g : gaussians) {
    g.mean[0] = static_cast<float>(random.uniform(-2, 2));
    g.mean[1] = static_cast<float>(random.uniform(-2, 2));
    g.mean[2] = static_cast<float>(random.uniform(2, 4));
    for (float& q : g.rotation) q = static_cast<float>(random.normal());
    for (float& s : g.log_scale) s = static_cast<float>(scale + 0.5 * random.normal());
    g.opacity_logit = static_cast<float>(random.normal());
    for (auto& coefficient : g.sh)
      for (float& value : coefficient) value = static_cast<float>(0.2 * random.normal());
  }
  model.add(0, gaussians);
  model.sort_spatially();
  return model;
}

Camera camera_of(const benchmark::State& state) {
  const int width = static_cast<int>(state.range(1)), height = static_cast<int>(state.range(2));
  const float f = 0.9f * static_cast<float>(width);
  return {width, height, f, f, 0.5f * static_cast<float>(width), 0.5f * static_cast<float>(height)};
}

void BM_Render(benchmark::State& state) {
  const GaussianModel model = make_cloud(static_cast<int>(state.range(0)));
  const std::vector<Pose> poses(1);
  SerialExecutor executor;
  Renderer renderer;
  RenderResult image;
  for (auto _ : state) renderer.render(model, {camera_of(state), poses}, {}, executor, image);
  state.counters["visible"] = image.visible;
}

void BM_Step(benchmark::State& state) {
  GaussianModel model = make_cloud(static_cast<int>(state.range(0)));
  const Camera camera = camera_of(state);
  Random random(2);
  std::vector<uint8_t> rgb(static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height) * 3);
  for (uint8_t& v : rgb) v = static_cast<uint8_t>(random.index(256));
  const TargetImage target(camera.width, camera.height, rgb);
  const std::vector<Pose> poses(1);
  SerialExecutor executor;
  Trainer trainer;
  StepResult result;
  for (auto _ : state) result = trainer.step(model, {camera, poses}, target, {}, executor);
  state.counters["visible"] = result.visible;
}

/// One curve over the gaussians, one over the pixels.
void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int count : {1000, 10000, 100000, 500000, 1000000, 2000000}) benchmark->Args({count, 640, 480});
  for (const auto& [width, height] : {std::pair{160, 120}, {320, 240}, {1280, 720}, {1920, 1080}})
    benchmark->Args({100000, width, height});
  benchmark->Unit(benchmark::kMillisecond);
}
BENCHMARK(BM_Render)->Apply(sizes);
BENCHMARK(BM_Step)->Apply(sizes);
// Seven gigabytes of model: only on demand.
BENCHMARK(BM_Render)->Name("TenMillion")->Args({10000000, 640, 480})->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace photoslam::splatting
