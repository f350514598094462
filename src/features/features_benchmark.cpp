// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include "features/fast.h"
#include "features/grey_pyramid.h"
#include "features/orb.h"
#include "features/test_images.h"

namespace photoslam {
namespace {

const ImageU8& scene() {
  static const ImageU8 image = RectangleScene(640, 480, 800, 1).render(640, 480, [](double&, double&) {});
  return image;
}

void orb(benchmark::State& state) {
  OrbOptions options;
  options.num_features = static_cast<int>(state.range(0));
  OrbExtractor extractor(options);
  Features features;
  for (auto _ : state) extractor.extract(scene(), features);
  state.counters["features"] = static_cast<double>(features.size());
}
BENCHMARK(orb)->Arg(500)->Arg(1000)->Arg(2000)->Unit(benchmark::kMillisecond);

void pyramid(benchmark::State& state) {
  GreyPyramid levels;
  for (auto _ : state) levels.build(scene(), 8, 1.2);
}
BENCHMARK(pyramid)->Unit(benchmark::kMillisecond);

void fast(benchmark::State& state) {
  PaddedImage image(scene());
  std::vector<uint8_t> scratch;
  std::vector<Corner> corners;
  for (auto _ : state) {
    corners.clear();
    detect_fast(image.view(), 16, 7, scratch, corners);
  }
  state.counters["corners"] = static_cast<double>(corners.size());
}
BENCHMARK(fast)->Unit(benchmark::kMillisecond);

void gaussian_blur(benchmark::State& state) {
  PaddedImage source(scene()), target(scene());
  std::vector<uint8_t> scratch;
  for (auto _ : state) blur(source.view(), target.view(), scratch);
}
BENCHMARK(gaussian_blur)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace photoslam
