// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <numbers>

#include "features/brief.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/orientation.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef PHOTOSLAM_FEATURES_ORIENTATION_ONCE
#define PHOTOSLAM_FEATURES_ORIENTATION_ONCE
namespace photoslam::orientation {

constexpr int kRows = 2 * kPatchRadius + 1;
constexpr int kColumns = kRows + 1;  // One more than the disc is wide: a power of two.

/// 255 inside the disc, 0 outside.
struct DiscMask {
  alignas(32) uint8_t rows[kRows][kColumns] = {};
  constexpr DiscMask() {
    for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
      for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
        if (x * x + y * y <= kPatchRadius * kPatchRadius) rows[y + kPatchRadius][x + kPatchRadius] = 255;
      }
    }
  }
};
inline constexpr DiscMask kDisc;

struct Moments {
  int32_t x = 0, y = 0;
};

}  // namespace photoslam::orientation
#endif

HWY_BEFORE_NAMESPACE();
namespace photoslam::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace orientation;  // NOLINT(google-build-using-namespace)

Moments disc_moments(const uint8_t* top_left, ptrdiff_t stride) {
  const hn::CappedTag<int16_t, kColumns> words;
  const hn::Rebind<uint8_t, decltype(words)> bytes;
  const int lanes = static_cast<int>(hn::Lanes(words));
  Moments moments;
  alignas(64) int16_t sums[kColumns], weighted[kColumns];
  for (int x = 0; x < kColumns; x += lanes) {
    // Sums of every column, and of every column times y: at most 31 * 255 and 120 * 255, which int16 can hold.
    auto sum = hn::Zero(words), weighted_sum = sum;
    for (int y = 0; y < kRows; ++y) {
      const auto row = hn::And(hn::LoadU(bytes, top_left + y * stride + x), hn::LoadU(bytes, kDisc.rows[y] + x));
      const auto values = hn::PromoteTo(words, row);
      sum = hn::Add(sum, values);
      weighted_sum = hn::Add(weighted_sum, hn::Mul(values, hn::Set(words, static_cast<int16_t>(y - kPatchRadius))));
    }
    hn::StoreU(sum, words, sums + x);
    hn::StoreU(weighted_sum, words, weighted + x);
  }
  for (int x = 0; x < kColumns; ++x) {
    moments.x += (x - kPatchRadius) * sums[x];
    moments.y += weighted[x];
  }
  return moments;
}

}  // namespace photoslam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam {
HWY_EXPORT(disc_moments);

float intensity_centroid_angle(const GreyView& image, int x, int y) {
  const auto moments = HWY_DYNAMIC_DISPATCH(disc_moments)(image.at(x - kPatchRadius, y - kPatchRadius), image.stride);
  const float angle = std::atan2(static_cast<float>(moments.y), static_cast<float>(moments.x));
  if (angle >= 0) return angle;
  constexpr float kTurn = static_cast<float>(2 * std::numbers::pi);
  return angle + kTurn < kTurn ? angle + kTurn : 0.0f;  // A tiny negative angle rounds up to the full turn.
}

}  // namespace photoslam
#endif  // HWY_ONCE
