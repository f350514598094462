// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Undistortion on a device against plain code: on the host, or where nvcc compiles this file, on a GPU.
#ifndef __SANITIZE_THREAD__  // it does not know fibers

#include "splatting/cuda/undistorter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "splatting/cuda/test_device.h"

namespace photoslam::splatting::cuda {
namespace {

constexpr uint64_t kPlenty = uint64_t{1} << 24;
using Kind = DevicePicture::Kind;

/// A lens that takes pixels from anywhere, its last rows and columns included.
struct WildLens {
  int width, height, target_width, target_height;
  std::vector<Tap> taps;

  WildLens(Random& random, int w, int h, int tw, int th) : width(w), height(h), target_width(tw), target_height(th) {
    for (int i = 0; i < tw * th; ++i) {
      if (random.uniform() < 0.2) {
        taps.emplace_back();
        continue;
      }
      const auto any = [&](int end) { return static_cast<uint16_t>(random.index(end)); };
      const auto way = [&] { return random.uniform() < 0.2 ? uint16_t{256} : any(257); };
      taps.push_back({any(w - 1), any(h - 1), way(), way()});
    }
  }
  DeviceLens plain() const { return {width, height, taps.data(), target_width, target_height}; }
};

/// A picture with random values, and what becomes of it according to double precision.
template <class T>
struct Case {
  int lens;
  Kind kind;
  std::vector<T> distorted, want, got;

  Case(Random& random, const std::vector<WildLens>& lenses, int number, Kind k) : lens(number), kind(k) {
    const WildLens& l = lenses[static_cast<size_t>(lens)];
    const int channels = kind == Kind::rgb ? 3 : 1;
    distorted.resize(static_cast<size_t>(l.width * l.height * channels));
    for (T& value : distorted) value = static_cast<T>(random.index(sizeof(T) == 1 ? 256 : 65536));
    for (const Tap& tap : l.taps)
      for (int c = 0; c < channels; ++c) {
        const auto at = [&](int dx, int dy) {
          return static_cast<double>(
              distorted[static_cast<size_t>(((tap.y + dy) * l.width + tap.x + dx) * channels + c)]);
        };
        want.push_back(tap.x == Tap::kNowhere ? T{0} : static_cast<T>(sample(at, tap.fx / 256.0, tap.fy / 256.0)));
      }
    got.resize(want.size(), T{77});
  }
  template <class At>
  double sample(const At& at, double right, double down) const {
    if (kind == Kind::depth) return at(right >= 0.5 ? 1 : 0, down >= 0.5 ? 1 : 0);
    const double above = (1 - right) * at(0, 0) + right * at(1, 0), below = (1 - right) * at(0, 1) + right * at(1, 1);
    return std::floor((1 - down) * above + down * below + 0.5);
  }
  DevicePicture picture() { return {lens, kind, distorted.data(), got.data()}; }
};

/// Frames of a color camera with depth, and of a grey one of another size.
void expect_frames_as_by_plain_code(const TestDevice& device, size_t staging_bytes) {
  Random random(71);
  const std::vector<WildLens> lenses = {{random, 37, 23, 41, 19}, {random, 2, 2, 300, 3}};
  const DeviceLens plain[] = {lenses[0].plain(), lenses[1].plain()};
  const auto budget = std::make_shared<Budget>(kPlenty);
  Undistorter<TestDevice> undistorter(device.sibling(staging_bytes), budget, plain, 2);
  for (int frame = 0; frame < 4; ++frame) {
    Case<uint8_t> color(random, lenses, 0, frame == 1 ? Kind::grey : Kind::rgb), right(random, lenses, 1, Kind::grey);
    Case<uint16_t> depth(random, lenses, 0, Kind::depth);
    const DevicePicture pictures[] = {color.picture(), right.picture(), depth.picture()};
    undistorter.undistort(pictures, frame == 0 ? 1 : 3);  // later ones need more room
    EXPECT_EQ(color.got, color.want);
    if (frame == 0) continue;
    EXPECT_EQ(right.got, right.want);
    EXPECT_EQ(depth.got, depth.want);
  }
  undistorter.undistort(nullptr, 0);
}

TEST(CudaUndistorter, TakesPixelsAsPlainCodeDoes) {
  expect_frames_as_by_plain_code(TestDevice(), size_t{1} << 20);
  expect_frames_as_by_plain_code(TestDevice(), 4000);  // some pictures find no pinned memory
  expect_frames_as_by_plain_code(TestDevice(), 1);
#ifndef __CUDACC__
  expect_frames_as_by_plain_code(TestDevice(ThreadOrder::shuffled), 4000);
#endif
}

TEST(CudaUndistorter, SharesTheMemoryOfTheEngine) {
  Random random(72);
  const WildLens lens(random, 64, 64, 64, 64);
  const DeviceLens plain = lens.plain();
  const size_t table = lens.taps.size() * sizeof(Tap);
  Engine<TestDevice> engine(TestDevice(), 19 * table + table / 2);
  const uint64_t before = engine.peak_bytes();
  for (int i = 0; i < 100; ++i) EXPECT_NO_THROW((void)engine.make_undistorter(&plain, 1));  // and given back
  EXPECT_EQ(engine.peak_bytes(), before + table);
  std::vector<std::unique_ptr<DeviceUndistorter>> all;
  for (int i = 0; i < 19; ++i) all.push_back(engine.make_undistorter(&plain, 1));
  EXPECT_ANY_THROW((void)engine.make_undistorter(&plain, 1));
  Case<uint8_t> color(random, {lens}, 0, Kind::rgb);
  const DevicePicture picture = color.picture();
  EXPECT_ANY_THROW(all[0]->undistort(&picture, 1));
  all.resize(10);
  all[0]->undistort(&picture, 1);
  EXPECT_EQ(color.got, color.want);
}

}  // namespace
}  // namespace photoslam::splatting::cuda

#endif  // __SANITIZE_THREAD__
