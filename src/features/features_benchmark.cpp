// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <algorithm>

#include "base/random.h"
#include "features/fast.h"
#include "features/grey_pyramid.h"
#include "features/matching.h"
#include "features/orb.h"
#include "features/place_index.h"
#include "features/stereo_matching.h"
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
  const ImageU8& image = scene();  // drawn by the first benchmark that asks for it
  for (auto _ : state) extractor.extract(image, features);
  state.counters["features"] = static_cast<double>(features.size());
}
BENCHMARK(orb)->Arg(500)->Arg(1250)->Arg(2000)->Unit(benchmark::kMillisecond);

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

/// Places that resemble each other in some corners, as those of one building do, and a revisit: a third of the
/// descriptors again, an eighth of their bits flipped.
void place_query(benchmark::State& state) {
  constexpr size_t kDescriptors = 300;
  const int num_places = static_cast<int>(state.range(0));
  Random random(1);
  const auto descriptor = [&random] { return Descriptor{random.next(), random.next(), random.next(), random.next()}; };
  const auto seen_again = [&random](Descriptor d) {
    for (size_t bit = 0; bit < 256; ++bit) {
      if (random.uniform() < 0.125) d[bit / 64] ^= uint64_t{1} << (bit % 64);
    }
    return d;
  };
  std::vector<Descriptor> common(2000);
  for (Descriptor& d : common) d = descriptor();
  PlaceIndex index;
  std::vector<std::vector<Descriptor>> queries;
  for (int place = 0; place < num_places; ++place) {
    std::vector<Descriptor> descriptors;
    for (size_t i = 0; i < kDescriptors; ++i) {
      descriptors.push_back(i % 3 == 0 ? seen_again(common[static_cast<size_t>(random.index(2000))]) : descriptor());
    }
    index.add(place, descriptors);
    if (place % (num_places / 50) != 0) continue;
    auto& query = queries.emplace_back();
    for (const Descriptor& d : descriptors) query.push_back(random.uniform() < 0.35 ? seen_again(d) : descriptor());
  }
  size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(index.query(queries[next++ % queries.size()], 5));
  }
  int found = 0;
  for (size_t i = 0; i < queries.size(); ++i) {
    const auto candidates = index.query(queries[i], 5);
    found += std::ranges::any_of(
        candidates, [&](const PlaceCandidate& c) { return c.place == static_cast<int>(i) * (num_places / 50); });
  }
  state.counters["recall@5"] = found / static_cast<double>(queries.size());
}
BENCHMARK(place_query)->Arg(100)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);

void brute_force_matching(benchmark::State& state) {
  Features features;
  OrbExtractor({}).extract(scene(), features);
  std::vector<int> matches;
  for (auto _ : state) match_brute_force({}, features, features, matches);
  state.counters["features"] = static_cast<double>(features.size());
}
BENCHMARK(brute_force_matching)->Unit(benchmark::kMillisecond);

/// A rig 60 pixels wide of disparities: search, check from right to left, refinement.
void stereo(benchmark::State& state) {
  OrbExtractor extractor({});
  Features features;
  extractor.extract(scene(), features);
  GreyPyramid right;
  right.build(RectangleScene(640, 480, 800, 1).render(640, 480, [](double& x, double&) { x += 20; }), 8, 1.2);
  StereoMatcher matcher({});
  std::vector<float> disparity;
  int matches = 0;
  for (auto _ : state) {
    matches =
        matcher.match(extractor.pyramid(), features.keypoints, right, static_cast<double>(state.range(0)), disparity);
  }
  state.counters["matches"] = matches;
}
BENCHMARK(stereo)->Arg(130)->Arg(350)->Unit(benchmark::kMillisecond);

void gaussian_blur(benchmark::State& state) {
  PaddedImage source(scene()), target(scene());
  std::vector<uint8_t> scratch;
  for (auto _ : state) blur(source.view(), target.view(), scratch);
}
BENCHMARK(gaussian_blur)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace photoslam
